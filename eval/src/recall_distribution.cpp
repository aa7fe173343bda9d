#include "scanloc/eval/recall_distribution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanloc::eval {

RevisitKind KindOf(const RevisitVariance& variance) {
  const bool is_lateral = variance.translation_m >= kLateralFrom_m;
  const bool is_rotational = variance.rotation_deg >= kRotationalFrom_deg;
  if (is_lateral && is_rotational) return RevisitKind::kBoth;
  if (is_lateral) return RevisitKind::kLateral;
  return is_rotational ? RevisitKind::kRotational : RevisitKind::kEasy;
}

const char* KindName(RevisitKind kind) {
  switch (kind) {
    case RevisitKind::kEasy:
      return "easy";
    case RevisitKind::kLateral:
      return "lateral";
    case RevisitKind::kRotational:
      return "rotational";
    case RevisitKind::kBoth:
      return "both";
  }
  return "unknown";
}

RevisitHistogram::RevisitHistogram(double max_translation_m)
    : num_translation_bins_(
          std::max(1, static_cast<int>(std::ceil(max_translation_m / kTranslationBin_m)))),
      counts_(static_cast<std::size_t>(num_translation_bins_) * kNumRotationBins) {}

void RevisitHistogram::Add(const RevisitVariance& variance) {
  const int translation = std::clamp(static_cast<int>(variance.translation_m / kTranslationBin_m),
                                     0, num_translation_bins_ - 1);
  const int rotation = std::clamp(static_cast<int>(variance.rotation_deg / kRotationBin_deg), 0,
                                  kNumRotationBins - 1);
  ++counts_[static_cast<std::size_t>(translation) * kNumRotationBins +
            static_cast<std::size_t>(rotation)];
  ++total_;
}

std::size_t RevisitHistogram::count(int translation_bin, int rotation_bin) const {
  return counts_[static_cast<std::size_t>(translation_bin) * kNumRotationBins +
                 static_cast<std::size_t>(rotation_bin)];
}

std::optional<double> Divergence(const RevisitHistogram& all, const RevisitHistogram& found) {
  if (found.total() == 0) return std::nullopt;
  double sum = 0.0;
  for (std::size_t i = 0; i < found.counts().size(); ++i) {
    if (found.counts()[i] == 0) continue;
    const double f = static_cast<double>(found.counts()[i]) / static_cast<double>(found.total());
    const double p = static_cast<double>(all.counts()[i]) / static_cast<double>(all.total());
    sum += f * std::log(f / p);
  }
  // Never negative but for rounding.
  return std::max(0.0, sum);
}

std::vector<double> MeasureDivergences(std::span<const RevisitVariance> variances,
                                       std::span<const ScoredQuery> queries,
                                       std::span<const OperatingPoint> points, double within_m,
                                       std::optional<RevisitKind> of_kind) {
  RevisitHistogram all(within_m);
  std::vector<std::size_t> right;  // numbers of queries
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (!queries[i].is_revisit || (of_kind && KindOf(variances[i]) != *of_kind)) continue;
    all.Add(variances[i]);
    if (queries[i].is_right) right.push_back(i);
  }
  std::vector<double> divergences;
  if (all.total() == 0 && of_kind) return divergences;
  std::ranges::sort(
      right, [&](std::size_t a, std::size_t b) { return queries[a].score > queries[b].score; });
  RevisitHistogram found(within_m);
  auto next = right.begin();
  for (const OperatingPoint& point : points) {
    for (; next != right.end() && queries[*next].score >= point.threshold; ++next) {
      found.Add(variances[*next]);
    }
    divergences.push_back(
        Divergence(all, found).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return divergences;
}

}  // namespace scanloc::eval
