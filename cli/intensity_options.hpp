#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/dataset/radar.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/eval/evaluation.hpp"
#include "scanloc/eval/intensity_contexts.hpp"

namespace scanloc::cli {

/// What methods with -intensity and -radar work on, as options of the command line: the intensities
/// of the scans themselves, or radar images that were taken along with them.
class IntensityOptions {
 public:
  /// Declares --radar, --map-radar, --radar-layout and --radar-resolution-m.
  void Declare(CLI::App& app);

  /// What the options and such methods need of others.
  [[nodiscard]] absl::Status CheckUsage(const std::vector<std::string>& methods, bool in_session,
                                        double tilt_deg) const;

  /// The scans of an evaluation.
  struct Scans {
    const std::vector<eval::EvalQuery>& queries;
    const std::vector<dataset::ScanFile>& query_files;
    const SensorMount& query_mount;
    const std::vector<dataset::ScanFile>& place_files;  ///< empty: not known
    const SensorMount& place_mount;
    const Map& map;
  };
  /// Appends the baselines of such methods, which read every scan or image. Errors: a scan without
  /// intensities, one without an image within kMaxRadarGap_ns, and those of reading.
  [[nodiscard]] absl::Status AddTo(const Scans& scans, bool quiet,
                                   eval::EvalOptions* options) const;

  /// One turn of a radar at 4 Hz [ns].
  static constexpr std::int64_t kMaxRadarGap_ns = 250'000'000;

 private:
  [[nodiscard]] dataset::RadarLayout layout() const;
  [[nodiscard]] std::optional<double> resolution_m() const;
  /// The image of each query, then of each place.
  [[nodiscard]] absl::StatusOr<std::vector<std::string>> FindImages(const Scans& scans) const;

  std::vector<std::string> radar_;
  std::vector<std::string> map_radar_;
  std::string layout_ = "oxford";
  std::optional<double> resolution_m_;  // none: the layout's
};

}  // namespace scanloc::cli
