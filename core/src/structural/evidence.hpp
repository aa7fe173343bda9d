#pragma once

#include <span>
#include <vector>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "structural/query_match.hpp"

namespace scanloc {

/// What speaks for a scan having been taken at a pose, by the scan and the place there alone: the
/// same for the same pose, whatever else was searched (docs/algorithm.md, "Confidence"). Seen from
/// above: at what heights things stand tells alike places apart, but walls go from floor to ceiling
/// anywhere.
struct Support {
  double score = 0.0;  ///< QueryMatch::ScoreFromAbove
  /// By how much the score falls at the least when the pose is off by as much as would be wrong: 1
  /// m in any direction, 10° to either side.
  double sharpness = 0.0;
  /// The score less that of the place's mirror image, laid as well as it will lie: a scene that is
  /// like this one in all that many scenes have in common, and that the scan was not taken at.
  double over_mirror = 0.0;
  /// QueryMatch::InlierRatio, and by how much WithInliers falls when the place is mirrored.
  double inliers = 0.0;
  double over_mirror_exactly = 0.0;
  /// Share of the query's posts that stand where the place is seen through, and of the place's
  /// that stand where the query is; the sum of both.
  double contradicted = 0.0;
  /// Share of the directions in which the place shows nothing: what stands there, and may look like
  /// this, is not known.
  double unseen = 0.0;
  double unseen_by_query = 0.0;  ///< and in which the query shows nothing
  /// Of the query. Of few posts a score is high, and higher than another, by chance.
  std::size_t num_posts = 0;
};

/// A score, and how exactly the posts lie on each other, as what rivals are weighed by.
[[nodiscard]] inline double WithInliers(double score, double inliers,
                                        const EvidenceParams& params) {
  return score + params.inliers_share * (inliers - score);
}

/// Requires match.SetPlace(place). Leaves another place set.
[[nodiscard]] Support SupportOf(QueryMatch& match, const Structure& query, const Structure& place,
                                const PlanarPose& T_place_query);

/// The log-odds that a pose with such support is where the scan was taken, were there no other pose
/// in the map with a score like it.
[[nodiscard]] double SupportLogOdds(const Support& support, const EvidenceParams& params);

/// How much of a cohort, in [0, 1], some spots are that the first is better than
/// (EvidenceParams::cohort). 0 where there are few: being better than nothing says nothing.
[[nodiscard]] double CohortShare(std::span<const double> scores, const EvidenceParams& params);

/// The same with what a cohort says beyond, but even where the scan lies as well on the place's
/// mirror image, for what cannot be told from that cannot be told from the next room; and where it
/// lies as well a metre on.
[[nodiscard]] double GenuineLogOdds(const Support& support, double of_cohort,
                                    const EvidenceParams& params);

/// By how much the log-odds of a pose are less than those of another with a better score, by a scan
/// of so many posts: scores that differ by no more than chance does say nothing of which is right.
[[nodiscard]] double RivalryLogOdds(double better_score, double score, std::size_t num_posts,
                                    const EvidenceParams& params);
/// The same as far as scans that follow each other may add it up: they share their errors.
[[nodiscard]] double RivalryLogOddsInARow(double better_score, double score, std::size_t num_posts,
                                          const EvidenceParams& params);

/// How much more a rival counts that looks the other way than one that stands elsewhere: it is no
/// other place of the cohort (large_cohort_share: see Shares; 0 where such rivals are a cohort,
/// too), but perhaps this very hall, turned about, alike by all its posts wherever they lie
/// exactly.
[[nodiscard]] double MoreOfTurned(double score, double score_by_posts, std::size_t num_posts,
                                  double large_cohort_share, const EvidenceParams& params);

/// How likely each of some poses is the one among them, by their scores alone; sums up to 1.
/// large_cohort_share: CohortShare of twice as many, by which EvidenceParams::equal_in_cohort
/// counts.
[[nodiscard]] std::vector<double> Shares(std::span<const double> scores, std::size_t num_posts,
                                         const EvidenceParams& params,
                                         double large_cohort_share = 0.0);

/// How likely each of some poses, best first, is where the scan was taken: that it was taken at the
/// best one at all, for which its support speaks, times each one's share. Scores that may be equal
/// by chance count as equal, or for what they are as long as EvidenceParams::undecided is not
/// exceeded. cautious_scores: what they may be at most, beyond that; empty: no more.
[[nodiscard]] std::vector<double> Confidences(std::span<const double> scores,
                                              const Support& support, double cohort_share,
                                              const EvidenceParams& params,
                                              double large_cohort_share = 0.0,
                                              std::span<const double> cautious_scores = {});

/// Whether a scan that sees all around is explained by less than EvidenceParams::explaining_score.
[[nodiscard]] bool ExplainsLittle(double score, const Support& support,
                                  const EvidenceParams& params);

[[nodiscard]] double Logistic(double log_odds);

}  // namespace scanloc
