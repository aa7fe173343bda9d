#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

/// What a place recogniser's answers are worth (paper, Sec. "Dataset and Evaluation Criteria").
/// Pure functions; thread-safe.
namespace scanloc::eval {

/// One query as it was answered.
struct ScoredQuery {
  bool is_revisit = false;  ///< the map holds a place that it should have been recognised at
  bool has_match = false;   ///< a place was named, whatever the outcome
  bool is_right = false;    ///< the match lies near enough to the truth; never without a match
  double score = 0.0;       ///< how sure the answer is of its match; greater is surer
};

/// All matches of at least this score accepted.
struct OperatingPoint {
  double threshold = 0.0;
  /// Right ones among the accepted; 1 where nothing is accepted.
  double precision = 1.0;
  /// Right ones among *all* revisits: one that was matched wrongly, not accepted or not matched at
  /// all is missing. 0 where there are no revisits.
  double recall = 0.0;
  double f1 = 0.0;  ///< harmonic mean of the two; 0 where both are
};

struct PrecisionRecall {
  /// From the highest threshold to the lowest, one a distinct score: equal scores are accepted
  /// together. Empty without any match.
  std::vector<OperatingPoint> points;
  double area = 0.0;    ///< under precision over recall, trapezoids, from recall 0 at the first
                        ///< point's precision to the greatest recall
  double f1_max = 0.0;  ///< of all points; 0 without any
  /// The point of f1_max; of several the one of the highest threshold. None where f1_max is 0: no
  /// threshold is worth accepting a match at.
  std::optional<std::size_t> best;
  /// Greatest recall at which no accepted match is wrong; 0 if the surest one is.
  double recall_at_full_precision = 0.0;
  /// Ferrarini et al. 2020: mean of the precision at the least recall that is not 0, and of
  /// recall_at_full_precision. 0 where no match is right.
  double extended_precision = 0.0;

  /// The threshold of `best`; infinite, which accepts nothing, without one.
  [[nodiscard]] double BestThreshold() const {
    return best ? points[*best].threshold : std::numeric_limits<double>::infinity();
  }
};

/// A wrong match counts against precision whether its query is a revisit or not. O(n log n).
[[nodiscard]] PrecisionRecall MeasurePrecisionRecall(std::span<const ScoredQuery> queries);

/// Of the answers that were confident to about the same degree.
struct ReliabilityBin {
  double low = 0.0;  ///< confidences in [low, high); the last bin includes 1
  double high = 0.0;
  std::size_t num_queries = 0;
  double mean_confidence = 0.0;  ///< 0 of none
  double share_right = 0.0;      ///< 0 of none
};

struct Reliability {
  std::vector<ReliabilityBin> bins;
  /// Mean over the queries of |mean confidence - share right| of their bin; 0 without queries.
  double expected_calibration_error = 0.0;
};

/// Scores are read as probabilities that the match is right; queries without a match are left out.
/// Requires num_bins ≥ 1 and scores in [0, 1].
[[nodiscard]] Reliability MeasureReliability(std::span<const ScoredQuery> queries, int num_bins);

/// Share of the revisits for which one of the k best candidates is right. None where there are no
/// revisits, and where the method looks at fewer candidates than k, so that it cannot say.
/// `first_right[i]`: rank from 1 of the first right candidate of revisit i, 0 for none.
[[nodiscard]] std::optional<double> RecallAt(int k, std::span<const int> first_right,
                                             int num_candidates);

}  // namespace scanloc::eval
