#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/evaluation.hpp"

/// What answering and timing share; only for evaluation.cpp and stage_times.cpp.
namespace scanloc::eval {

inline constexpr int kNumAnswers = 10;

/// Who is asked. Any number of threads may ask.
struct EvalSubjects {
  const Localizer& localizer;
  std::map<std::string, std::shared_ptr<Baseline>> baselines;  ///< by name, prepared
};

/// What one method is asked.
struct EvalQuestion {
  PointView scan;
  const ScanDescriptor& descriptor;  ///< by the map's parameters
  const std::vector<bool>& hidden;   ///< places that it does not see; empty: it sees all
  std::size_t number = 0;            ///< of the query
};

/// Processor time of this thread: what it does not get while others run is not counted.
[[nodiscard]] std::int64_t ThreadNow_ns();

/// The scan of that query, turned if options ask for a tilt.
[[nodiscard]] absl::StatusOr<PointCloud> ReadQuery(std::size_t number, const EvalOptions& options);

/// Times are those of retrieval, matching and verification, and of the description where a baseline
/// makes its own.
[[nodiscard]] absl::StatusOr<Answer> Ask(const EvalSubjects& subjects, const EvalMethod& method,
                                         const EvalQuestion& question);

/// Asks options.num_timed queries once more, one after the other in this thread; one element a
/// method.
[[nodiscard]] absl::StatusOr<std::vector<StageMeans>> MeasureTimes(
    const EvalSubjects& subjects, const std::vector<EvalQuery>& queries,
    const EvalOptions& options);

}  // namespace scanloc::eval
