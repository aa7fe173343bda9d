#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"

namespace scanloc::mapdb {

struct CalibrateProgress {
  std::size_t num_done = 0;
  std::size_t num_trials = 0;
};

struct CalibrateOptions {
  std::string path;
  int num_threads = 0;  ///< at most 256; 0: one a processor
  /// Called from the thread that called CalibrateMap; may be null.
  std::function<void(const CalibrateProgress&)> progress;
  /// Asked between trials, from any thread; true ends it with Cancelled. May be null.
  std::function<bool()> is_cancelled;
};

struct CalibrateSummary {
  Calibration calibration;
  std::size_t num_confusable = 0;
  bool was_current = false;  ///< the file had its calibration already: nothing was done
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of the map frame (FindUp), where it was done
};

/// Finds out how far answers from a map can be trusted (core's Calibrator) and writes it into the
/// file, beside the content: the content id stays. What is written depends on the map alone, not on
/// the number of threads.
///
/// FailedPrecondition: the map has no structures, its file is of schema 1, or it is incomplete.
/// Unavailable: it was written meanwhile. Cancelled; or the errors of LoadMap and MapBuilder. On
/// any error the file is as it was.
[[nodiscard]] absl::StatusOr<CalibrateSummary> CalibrateMap(const CalibrateOptions& options);

}  // namespace scanloc::mapdb
