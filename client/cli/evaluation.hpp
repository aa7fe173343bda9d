#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/pose.hpp"
#include "scanloc/eval/measures.hpp"
#include "scanloc/eval/recall_distribution.hpp"

namespace scanloc::cli {

/// One scan to be looked up.
struct EvalQuery {
  std::string name;
  std::string path;
  std::optional<Pose> T_map_true;  ///< none: taken elsewhere, no revisit of the map
  bool is_revisit = false;
  eval::RevisitVariance variance;  ///< from the nearest place; of a revisit only
};

/// A method and how many candidates it takes, as `auto`, `a-pc` or `a-pc:10`.
struct EvalMethod {
  std::string name;  ///< as given
  Method method;
  std::optional<int> num_candidates;
};
/// InvalidArgument: no such method, or a bad number.
[[nodiscard]] absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text);

/// What one method said to all queries, in their order, and what it is worth.
struct MethodResult {
  std::string name;
  std::vector<eval::ScoredQuery> scored;
  std::vector<Eigen::Vector2d> matched_m;  ///< position of the best candidate; of none: zero
  std::vector<int> first_right;            ///< rank of the first right candidate, of each revisit

  eval::PrecisionRecall precision_recall;
  std::optional<eval::Reliability> reliability;  ///< of methods that tell a confidence
  std::vector<double> divergences;               ///< from all revisits, at each point of the curve
  double divergence_at_f1_max = 0.0;
  double threshold_at_f1_max = 0.0;
  /// Of right matches; none without any.
  std::optional<double> median_position_m, p90_position_m, median_yaw_deg, p90_yaw_deg;
  double mean_ms = 0.0;  ///< describing and searching, one thread
};

struct EvalOptions {
  std::vector<EvalMethod> methods;
  double within_m = 8.0;
  int num_threads = 0;  ///< 0: one a processor
};

/// Sets is_revisit and variance.
void FindRevisits(const Map& map, double within_m, std::vector<EvalQuery>* queries);

/// Reads and looks up every scan by every method; `told` is called from this thread as they are
/// done. The first scan that cannot be read ends it. The results do not depend on the threads.
[[nodiscard]] absl::StatusOr<std::vector<MethodResult>> Evaluate(
    const Localizer& localizer, const std::vector<EvalQuery>& queries, const EvalOptions& options,
    const std::function<void(std::size_t num_done)>& told);

}  // namespace scanloc::cli
