#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::cli {

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

/// How far a candidate is from the truth, in the plane.
struct TruthError {
  double place_m = 0.0;  ///< from the query's true position to the place
  double pose_m = 0.0;   ///< from the query's true position to T_map_query
  double yaw_deg = 0.0;  ///< between the true heading and that of T_map_query, in [0, 180]
};
[[nodiscard]] TruthError ErrorOf(const Candidate& candidate, const Pose& T_map_true);

/// What is said of all queries together.
struct Summary {
  std::size_t num_queries = 0;
  std::size_t num_localized = 0;
  std::size_t num_ambiguous = 0;
  std::size_t num_not_recognized = 0;
  std::size_t num_insufficient = 0;

  std::size_t num_with_truth = 0;  ///< the rest counts only these
  double within_m = 0.0;           ///< a place this near to the query is right
  std::size_t num_top1_right = 0;  ///< whose best candidate is right, whatever the outcome
  std::size_t num_topk_right = 0;  ///< one of whose candidates is right
  std::size_t num_localized_with_truth = 0;
  std::size_t num_localized_wrong = 0;
  /// Medians over those whose best candidate is right; none without any.
  std::optional<double> median_place_m;
  std::optional<double> median_pose_m;
  std::optional<double> median_yaw_deg;
};
[[nodiscard]] Summary Summarize(const std::vector<QueryResult>& results, double within_m);

/// The middle value, or the mean of the two in the middle; none of no values.
[[nodiscard]] std::optional<double> Median(std::vector<double> values);

}  // namespace scanloc::cli
