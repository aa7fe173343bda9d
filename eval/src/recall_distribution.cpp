#include "scanloc/eval/recall_distribution.hpp"

#include <algorithm>
#include <cmath>

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

double Divergence(const RevisitHistogram& all, const RevisitHistogram& found) {
  const auto num_bins = static_cast<double>(std::count_if(
      all.counts().begin(), all.counts().end(), [](std::size_t count) { return count > 0; }));
  double sum = 0.0;
  for (std::size_t i = 0; i < all.counts().size(); ++i) {
    if (all.counts()[i] == 0) continue;
    const double p = static_cast<double>(all.counts()[i]) / static_cast<double>(all.total());
    const double q = (static_cast<double>(found.counts()[i]) + 1.0 / num_bins) /
                     (static_cast<double>(found.total()) + 1.0);
    sum += p * std::log(p / q);
  }
  return sum;
}

}  // namespace scanloc::eval
