#pragma once

#include <array>
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
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/eval/measures.hpp"
#include "scanloc/eval/recall_distribution.hpp"

namespace scanloc::cli {

/// One scan to be looked up.
struct EvalQuery {
  std::string name;
  dataset::ScanFile file;
  std::optional<Pose> T_map_true;  ///< none: taken elsewhere, no revisit of the map
  std::int64_t stamp_ns = 0;       ///< 0: not known
  /// Of a growing map: it sees only places older than this; none: all.
  std::optional<std::int64_t> sees_until_ns;

  bool is_revisit = false;         ///< within the first of EvalOptions::within_m
  eval::RevisitVariance variance;  ///< from the nearest place that it sees
  bool has_place = false;          ///< there is one, and T_map_true
};

/// A method and how many candidates it takes, as `auto`, `a-pc` or `a-pc:10`; or a baseline.
struct EvalMethod {
  std::string name;  ///< as given
  Method method;
  std::optional<int> num_candidates;
  bool is_baseline = false;
};
/// InvalidArgument: no such method or baseline, or a bad number.
[[nodiscard]] absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text);

/// Of right matches.
struct ErrorSummary {
  double median = 0.0;
  double mean = 0.0;
  double p90 = 0.0;
};

/// Mean time of a stage a query, one thread [ms].
struct StageMeans {
  double describe_ms = 0.0;
  double retrieve_ms = 0.0;
  double match_ms = 0.0;
  double verify_ms = 0.0;
  double total_ms = 0.0;
  double total_p99_ms = 0.0;
};

inline constexpr int kNumKinds = 4;

/// What one method said to all queries, in their order, and what it is worth.
struct MethodResult {
  std::string name;
  double within_m = 0.0;  ///< what counts as a revisit and as right
  std::vector<eval::ScoredQuery> scored;
  std::vector<Eigen::Vector2d> matched_m;  ///< position of the best candidate; of none: zero
  std::vector<int> first_right;            ///< rank of the first right candidate, of each revisit

  /// Answers with the right pose to queries that are no revisits, as no place is within_m near:
  /// neither right nor wrong, they count as no match.
  std::size_t num_right_beyond = 0;

  eval::PrecisionRecall precision_recall;
  /// Of methods that tell a confidence: that the pose is within_m right.
  std::optional<eval::Reliability> reliability;
  std::vector<double> divergences;  ///< from all revisits, at each point of the curve
  /// Likewise among the revisits of each kind; empty where there are none of it.
  std::array<std::vector<double>, kNumKinds> kind_divergences;
  std::array<double, kNumKinds> kind_divergence_at_f1_max{};
  double divergence_at_f1_max = 0.0;
  double threshold_at_f1_max = 0.0;
  /// Of right matches; none without any, and of baselines, which tell no pose.
  std::optional<ErrorSummary> position_m, lateral_m, yaw_deg;
  StageMeans times;
};

struct EvalOptions {
  std::vector<EvalMethod> methods;
  std::vector<double> within_m = {8.0};  ///< each gives results of its own
  /// Scans are turned by roll and pitch of up to this, drawn by their number [deg].
  double tilt_deg = 0.0;
  int num_threads = 0;  ///< 0: one a processor
  /// Scan of each place of the map, for baselines; empty: there are none.
  std::vector<dataset::ScanFile> place_scans;
};

/// Sets is_revisit, variance and has_place.
void FindRevisits(const Map& map, double within_m, std::vector<EvalQuery>* queries);

/// Reads and looks up every scan by every method; `told` is called from this thread as they are
/// done. The first scan that cannot be read ends it. The results do not depend on the threads:
/// those of every method for the first within_m, then for the next.
[[nodiscard]] absl::StatusOr<std::vector<MethodResult>> Evaluate(
    const Localizer& localizer, const std::vector<EvalQuery>& queries, const EvalOptions& options,
    const std::function<void(std::size_t num_done)>& told);

}  // namespace scanloc::cli
