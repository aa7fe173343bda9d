#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace scanloc::eval {

/// How a revisit differs from the map's nearest place.
struct RevisitVariance {
  double translation_m = 0.0;  ///< distance in the plane
  double rotation_deg = 0.0;   ///< between the headings, in [0, 180]
};

/// The paper's quadrants.
enum class RevisitKind { kEasy, kLateral, kRotational, kBoth };
inline constexpr double kLateralFrom_m = 2.0;
inline constexpr double kRotationalFrom_deg = 90.0;
[[nodiscard]] RevisitKind KindOf(const RevisitVariance& variance);
/// `easy`, `lateral`, `rotational` or `both`.
[[nodiscard]] const char* KindName(RevisitKind kind);

/// Counts of revisits over translation and rotation in bins of 0.5 m × 10° (paper, "Recall
/// Distribution").
class RevisitHistogram {
 public:
  static constexpr double kTranslationBin_m = 0.5;
  static constexpr double kRotationBin_deg = 10.0;
  static constexpr int kNumRotationBins = 18;

  /// Translations from max_translation_m on go into the last bin.
  explicit RevisitHistogram(double max_translation_m);

  void Add(const RevisitVariance& variance);

  [[nodiscard]] int num_translation_bins() const { return num_translation_bins_; }
  [[nodiscard]] std::size_t count(int translation_bin, int rotation_bin) const;
  [[nodiscard]] std::size_t total() const { return total_; }
  [[nodiscard]] std::span<const std::size_t> counts() const { return counts_; }

 private:
  int num_translation_bins_;
  std::vector<std::size_t> counts_;  // translation bins of kNumRotationBins
  std::size_t total_ = 0;
};

/// Kullback-Leibler divergence [nats] of the revisits that were found from all there are, which are
/// the reference: Σ P·log(P/Q) over the bins that hold a revisit.
///
/// The found ones share one more event evenly among these bins, so that it is finite; with all
/// found it is near 0. 0 where there are no revisits. Requires histograms of equal shape.
[[nodiscard]] double Divergence(const RevisitHistogram& all, const RevisitHistogram& found);

}  // namespace scanloc::eval
