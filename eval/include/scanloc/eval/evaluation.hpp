#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/judging.hpp"
#include "scanloc/eval/measures.hpp"
#include "scanloc/eval/quantile.hpp"
#include "scanloc/eval/recall_distribution.hpp"

namespace scanloc::eval {

/// One scan to be looked up.
struct EvalQuery {
  std::string name;
  std::optional<Pose> T_map_true;  ///< none: taken elsewhere, no revisit of the map
  std::int64_t stamp_ns = 0;       ///< 0: not known
  /// Of a growing map: it sees only places older than this; none: all.
  std::optional<std::int64_t> sees_until_ns;

  bool is_revisit = false;   ///< within the first of EvalOptions::within_m
  RevisitVariance variance;  ///< from the nearest place that it sees
  bool has_place = false;    ///< there is one, and T_map_true
};

/// A method and how many candidates it takes, as `auto`, `a-pc` or `a-pc:10`; or a baseline.
struct EvalMethod {
  std::string name;  ///< as given
  Method method;
  std::optional<int> num_candidates;
  bool is_baseline = false;
  std::string baseline;  ///< its name
};
/// InvalidArgument: no such method or baseline, or a bad number.
[[nodiscard]] absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text);

/// OK if a map of these parameters can serve the method, else FailedPrecondition that says why.
[[nodiscard]] absl::Status CheckServes(const Params& params, const EvalMethod& method);

/// Mean processor time of a stage a query, one thread, nothing else of this program running [ms].
struct StageMeans {
  double describe_ms = 0.0;        ///< of what the method alone needs
  double describe_place_ms = 0.0;  ///< for the map, with root shifts; only with time_places
  double retrieve_ms = 0.0;
  double match_ms = 0.0;
  double verify_ms = 0.0;
  double total_ms = 0.0;  ///< of a query
  double total_p99_ms = 0.0;
};

inline constexpr int kNumKinds = kNumRevisitKinds;

/// What one method said to all queries, in their order, and what it is worth.
struct MethodResult {
  std::string name;
  double within_m = 0.0;  ///< what counts as a revisit and as right
  std::vector<ScoredQuery> scored;
  struct Told {
    Outcome outcome;
    std::optional<PoseError> error;  ///< of the best candidate's pose, where both are known
  };
  std::vector<Told> told;
  OutcomeCounts outcomes;                  ///< by the pose
  bool tells_outcome = true;               ///< false: a baseline
  std::vector<Eigen::Vector2d> matched_m;  ///< position of the best candidate; of none: zero
  std::vector<int> first_right;            ///< rank of the first right candidate, of each revisit
  /// So many places it looks at, at most; recall beyond is none.
  int num_candidates = std::numeric_limits<int>::max();

  /// Answers with the right pose to queries that are no revisits, as no place is within_m near.
  /// They count as wrong: what is judged is the place.
  std::size_t num_right_beyond = 0;

  PrecisionRecall precision_recall;
  /// Of methods that tell a confidence: that the pose is right.
  std::optional<Reliability> reliability;
  /// From all revisits, at each point of the curve; NaN where no revisit is found.
  std::vector<double> divergences;
  /// Likewise among the revisits of each kind; empty where there are none of it.
  std::array<std::vector<double>, kNumKinds> kind_divergences;
  /// None where no revisit, or none of the kind, is found at the greatest F1.
  std::array<std::optional<double>, kNumKinds> kind_divergence_at_f1_max;
  std::optional<double> divergence_at_f1_max;
  /// Of all right matches, accepted or not; none without any, and of baselines, which tell no pose.
  std::optional<ErrorSummary> position_m, lateral_m, yaw_deg;
  StageMeans times;
};

using ReadScan = std::function<absl::StatusOr<PointCloud>(std::size_t number)>;

struct EvalOptions {
  std::vector<EvalMethod> methods;
  /// Beside those that MakeBaseline knows, by their names; all that MakeIntensityContexts makes.
  std::vector<std::shared_ptr<Baseline>> baselines = {};
  std::vector<double> within_m = {8.0};  ///< each gives results of its own
  /// Scans are turned by roll and pitch of up to this, drawn by their number [deg].
  double tilt_deg = 0.0;
  int num_threads = 0;  ///< 0: one a processor
  /// Queries, spread evenly, that are asked once more by one thread for the times.
  std::size_t num_timed = 50;
  bool time_places = false;  ///< also describe them as places of a map would be
  /// The scans of the queries, and of the map's places, which some baselines need (null: there are
  /// none), by number. Several threads may read at once.
  ReadScan read_query;
  ReadScan read_place = nullptr;
};

/// Sets is_revisit, variance and has_place.
void FindRevisits(const Map& map, double within_m, std::vector<EvalQuery>* queries);

/// Reads and looks up every scan by every method; `told` is called from this thread as they are
/// done. The first scan that cannot be read ends it. The results, but for times, do not depend on
/// the threads: those of every method for the first within_m, then for the next.
[[nodiscard]] absl::StatusOr<std::vector<MethodResult>> Evaluate(
    const Localizer& localizer, const std::vector<EvalQuery>& queries, const EvalOptions& options,
    const std::function<void(std::size_t num_done)>& told);

}  // namespace scanloc::eval
