#include "scanloc/report/query_result.hpp"

#include <algorithm>
#include <utility>

#include "scanloc/eval/ground_truth.hpp"
#include "scanloc/eval/quantile.hpp"

namespace scanloc::report {
TruthError ErrorOf(const Candidate& candidate, const Pose& T_map_true) {
  return {eval::PlanarDistance_m(candidate.T_map_place, T_map_true),
          DifferenceOf(candidate.T_map_query, T_map_true)};
}

Summary Summarize(const std::vector<QueryResult>& results, double within_m) {
  Summary summary;
  summary.within_m = within_m;
  std::vector<double> places_m;
  std::vector<double> poses_m;
  std::vector<double> yaws_deg;
  for (const QueryResult& result : results) {
    const Answer& answer = result.answer;
    summary.all.Add(answer);
    if (!result.T_map_true.has_value()) continue;
    const eval::QueryTruth truth{.T_map_query = result.T_map_true, .nearest = {}};
    summary.with_truth.Add(answer, eval::Judge(truth, answer.candidates, within_m));
    const auto is_right = [&](const Candidate& candidate) {
      return ErrorOf(candidate, *result.T_map_true).place_m <= within_m;
    };
    const bool top1_right = !answer.candidates.empty() && is_right(answer.candidates.front());
    if (top1_right) {
      ++summary.num_top1_right;
      const TruthError error = ErrorOf(answer.candidates.front(), *result.T_map_true);
      places_m.push_back(error.place_m);
      poses_m.push_back(error.pose.plane_m);
      yaws_deg.push_back(error.pose.heading_deg);
    }
    if (std::ranges::any_of(answer.candidates, is_right)) {
      ++summary.num_topk_right;
    }
  }
  summary.median_place_m = eval::Quantile(std::move(places_m), 0.5);
  summary.median_pose_m = eval::Quantile(std::move(poses_m), 0.5);
  summary.median_yaw_deg = eval::Quantile(std::move(yaws_deg), 0.5);
  return summary;
}

}  // namespace scanloc::report
