#include "scanloc/eval/measures.hpp"

#include <algorithm>
#include <cmath>

namespace scanloc::eval {
namespace {

double AreaUnder(const std::vector<OperatingPoint>& points) {
  if (points.empty()) return 0.0;
  double area = 0.0;
  OperatingPoint last{.precision = points.front().precision, .recall = 0.0};
  for (const OperatingPoint& point : points) {
    area += 0.5 * (point.precision + last.precision) * (point.recall - last.recall);
    last = point;
  }
  return area;
}

}  // namespace

PrecisionRecall MeasurePrecisionRecall(std::span<const ScoredQuery> queries) {
  const auto num_revisits =
      std::ranges::count_if(queries, [](const ScoredQuery& q) { return q.is_revisit; });
  std::vector<ScoredQuery> matched;
  std::copy_if(queries.begin(), queries.end(), std::back_inserter(matched),
               [](const ScoredQuery& q) { return q.has_match; });
  std::ranges::stable_sort(
      matched, [](const ScoredQuery& a, const ScoredQuery& b) { return a.score > b.score; });

  PrecisionRecall result;
  std::size_t num_right = 0;
  for (std::size_t i = 0; i < matched.size(); ++i) {
    num_right += matched[i].is_right ? 1 : 0;
    const bool is_tie = i + 1 < matched.size() && matched[i + 1].score == matched[i].score;
    if (is_tie) continue;
    OperatingPoint point{.threshold = matched[i].score};
    point.precision = static_cast<double>(num_right) / static_cast<double>(i + 1);
    if (num_revisits > 0) {
      point.recall = static_cast<double>(num_right) / static_cast<double>(num_revisits);
    }
    // Of whole numbers, so that equal ones are equal in all bits.
    point.f1 = 2.0 * static_cast<double>(num_right) /
               static_cast<double>(i + 1 + static_cast<std::size_t>(num_revisits));
    if (point.f1 > result.f1_max) {
      result.f1_max = point.f1;
      result.best = result.points.size();
    }
    if (num_right == i + 1) result.recall_at_full_precision = point.recall;
    result.points.push_back(point);
  }
  result.area = AreaUnder(result.points);
  const auto first_found =
      std::ranges::find_if(result.points, [](const OperatingPoint& p) { return p.recall > 0.0; });
  if (first_found != result.points.end()) {
    result.extended_precision = 0.5 * (first_found->precision + result.recall_at_full_precision);
  }
  return result;
}

Reliability MeasureReliability(std::span<const ScoredQuery> queries, int num_bins) {
  Reliability result;
  for (int i = 0; i < num_bins; ++i) {
    result.bins.push_back(
        {.low = static_cast<double>(i) / num_bins, .high = static_cast<double>(i + 1) / num_bins});
  }
  std::size_t num_matched = 0;
  for (const ScoredQuery& query : queries) {
    if (!query.has_match) continue;
    const int bin = std::clamp(static_cast<int>(query.score * num_bins), 0, num_bins - 1);
    ReliabilityBin& target = result.bins[static_cast<std::size_t>(bin)];
    ++target.num_queries;
    target.mean_confidence += query.score;
    target.share_right += query.is_right ? 1.0 : 0.0;
    ++num_matched;
  }
  for (ReliabilityBin& bin : result.bins) {
    if (bin.num_queries == 0) continue;
    result.expected_calibration_error +=
        std::abs(bin.mean_confidence - bin.share_right) / static_cast<double>(num_matched);
    bin.mean_confidence /= static_cast<double>(bin.num_queries);
    bin.share_right /= static_cast<double>(bin.num_queries);
  }
  return result;
}

std::optional<double> RecallAt(int k, std::span<const int> first_right, int num_candidates) {
  if (first_right.empty() || k > num_candidates) return std::nullopt;
  const auto num_found =
      std::ranges::count_if(first_right, [&](int rank) { return rank >= 1 && rank <= k; });
  return static_cast<double>(num_found) / static_cast<double>(first_right.size());
}

}  // namespace scanloc::eval
