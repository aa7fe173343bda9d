#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/eval/judging.hpp"

namespace scanloc::report {

/// What was said to one scan, and what is true.
struct QueryResult {
  std::string query;  ///< the scan's file name
  Answer answer;
  int num_scans = 0;               ///< of a sequence: that the best candidate rests on
  bool is_relocated = false;       ///< of a sequence: as in TrackedAnswer
  std::optional<Pose> T_map_true;  ///< of the query; none where it is not known
  std::int64_t read_ns = 0;        ///< time to read the scan's file
  std::int64_t ask_ns = 0;         ///< time from the scan in memory to the answer
};

/// How far a candidate is from the truth.
struct TruthError {
  double place_m = 0.0;  ///< in the plane, from the query's true position to the place
  PoseDifference pose;   ///< of T_map_query from the true pose
};
[[nodiscard]] TruthError ErrorOf(const Candidate& candidate, const Pose& T_map_true);

/// What is said of all queries together.
struct Summary {
  eval::OutcomeCounts all;

  eval::OutcomeCounts with_truth;  ///< the rest counts only these
  double within_m = 0.0;           ///< a place this near to the query is recalled, as in the paper
  std::size_t num_top1_right = 0;  ///< whose best candidate is such a place, whatever the outcome
  std::size_t num_topk_right = 0;  ///< one of whose candidates is such a place
  /// Medians over those whose best candidate is such a place; none without any.
  std::optional<double> median_place_m;
  std::optional<double> median_pose_m;
  std::optional<double> median_yaw_deg;
};
[[nodiscard]] Summary Summarize(const std::vector<QueryResult>& results, double within_m);

}  // namespace scanloc::report
