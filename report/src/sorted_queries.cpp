#include "sorted_queries.hpp"

namespace scanloc::report {

SortedQueries SortQueries(const EvalReport& report, const eval::MethodResult& result,
                          std::optional<double> threshold) {
  SortedQueries sorted;
  for (std::size_t i = 0; i < report.queries.size(); ++i) {
    const eval::EvalQuery& query = report.queries[i];
    const eval::ScoredQuery& scored = result.scored[i];
    const auto kind = static_cast<std::size_t>(eval::KindOf(query.variance));
    if (threshold && scored.has_match && scored.score >= *threshold) {
      if (!query.T_map_true) {
        ++sorted.num_wrong_elsewhere;
      } else if (scored.is_right) {
        sorted.right[kind].push_back(i);
      } else {
        sorted.wrong.push_back(i);
      }
    } else if (scored.is_revisit) {
      sorted.missed[kind].push_back(i);
    }
  }
  return sorted;
}

std::size_t CountAll(const QueriesByKind& kinds) {
  std::size_t count = 0;
  for (const std::vector<std::size_t>& queries : kinds) count += queries.size();
  return count;
}

std::optional<double> ThresholdAtF1Max(const eval::MethodResult& result) {
  const eval::PrecisionRecall& curve = result.precision_recall;
  return curve.best ? std::optional(curve.BestThreshold()) : std::nullopt;
}

std::optional<double> ThresholdAtFullPrecision(const eval::MethodResult& result) {
  std::optional<double> threshold;
  for (const eval::OperatingPoint& point : result.precision_recall.points) {
    if (point.precision < 1.0) break;
    threshold = point.threshold;
  }
  return threshold;
}

}  // namespace scanloc::report
