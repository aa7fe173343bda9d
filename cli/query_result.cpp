#include "cli/query_result.hpp"

#include <algorithm>
#include <utility>

#include "scanloc/eval/ground_truth.hpp"
#include "scanloc/eval/quantile.hpp"

namespace scanloc::cli {
namespace {

void CountOutcome(Outcome outcome, Summary* summary) {
  switch (outcome) {
    case Outcome::kLocalized:
      ++summary->num_localized;
      break;
    case Outcome::kAmbiguous:
      ++summary->num_ambiguous;
      break;
    case Outcome::kNotRecognized:
      ++summary->num_not_recognized;
      break;
    case Outcome::kInsufficientScan:
      ++summary->num_insufficient;
      break;
  }
}

}  // namespace

TruthError ErrorOf(const Candidate& candidate, const Pose& T_map_true) {
  return {eval::PlanarDistance_m(candidate.T_map_place, T_map_true),
          eval::PlanarDistance_m(candidate.T_map_query, T_map_true),
          eval::HeadingDifference_deg(candidate.T_map_query, T_map_true)};
}

Summary Summarize(const std::vector<QueryResult>& results, double within_m) {
  Summary summary;
  summary.num_queries = results.size();
  summary.within_m = within_m;
  std::vector<double> places_m;
  std::vector<double> poses_m;
  std::vector<double> yaws_deg;
  for (const QueryResult& result : results) {
    const Answer& answer = result.answer;
    CountOutcome(answer.outcome, &summary);
    if (!result.T_map_true.has_value()) continue;
    ++summary.num_with_truth;
    const auto is_right = [&](const Candidate& candidate) {
      return ErrorOf(candidate, *result.T_map_true).place_m <= within_m;
    };
    const bool top1_right = !answer.candidates.empty() && is_right(answer.candidates.front());
    if (top1_right) {
      ++summary.num_top1_right;
      const TruthError error = ErrorOf(answer.candidates.front(), *result.T_map_true);
      places_m.push_back(error.place_m);
      poses_m.push_back(error.pose_m);
      yaws_deg.push_back(error.yaw_deg);
    }
    if (std::any_of(answer.candidates.begin(), answer.candidates.end(), is_right)) {
      ++summary.num_topk_right;
    }
    if (answer.outcome == Outcome::kLocalized) {
      ++summary.num_localized_with_truth;
      if (!top1_right) ++summary.num_localized_wrong;
    }
  }
  summary.median_place_m = Median(std::move(places_m));
  summary.median_pose_m = Median(std::move(poses_m));
  summary.median_yaw_deg = Median(std::move(yaws_deg));
  return summary;
}

std::optional<double> Median(std::vector<double> values) {
  return eval::Quantile(std::move(values), 0.5);
}

}  // namespace scanloc::cli
