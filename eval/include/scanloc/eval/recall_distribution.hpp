#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "scanloc/eval/measures.hpp"

namespace scanloc::eval {

/// How a revisit differs from the map's nearest place.
struct RevisitVariance {
  double translation_m = 0.0;  ///< distance in the plane
  double rotation_deg = 0.0;   ///< between the headings, in [0, 180]
};

/// The paper's quadrants. It gives no numbers for their limits; these are ours.
enum class RevisitKind { kEasy, kLateral, kRotational, kBoth };
inline constexpr int kNumRevisitKinds = 4;
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
/// the reference (paper, "Recall Distribution"): Σ F·ln(F/P) over the bins, F the share of the
/// found ones and P that of all.
///
/// Finite without smoothing, as what is found is among all. 0 if the found ones are spread as all
/// are, however few; ln(1/P) if they all lie in bins that hold the share P of all. None where
/// nothing is found. Requires histograms of equal shape, and found no more than all in every bin.
[[nodiscard]] std::optional<double> Divergence(const RevisitHistogram& all,
                                               const RevisitHistogram& found);

/// The DR curve: the divergence at each point of the curve, of the revisits that are right and
/// accepted there, from all. Of one kind, or of all: `of_kind` gives what is counted on both sides.
/// NaN at points where none of them is found; empty where there are none of the kind.
/// Requires one variance a query; those of queries that are no revisits are not looked at.
[[nodiscard]] std::vector<double> MeasureDivergences(std::span<const RevisitVariance> variances,
                                                     std::span<const ScoredQuery> queries,
                                                     std::span<const OperatingPoint> points,
                                                     double within_m,
                                                     std::optional<RevisitKind> of_kind);

}  // namespace scanloc::eval
