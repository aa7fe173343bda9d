#include "structural/evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "scan/bearing.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/pose_difference.hpp"

namespace scanloc {
namespace {

/// What the mean of so many posts' agreement varies by.
double ChanceOf(std::size_t num_posts) {
  return 1.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(num_posts, 1)));
}

/// By how much scores differ that are equal but for chance.
double EqualByChance(std::size_t num_posts, const EvidenceParams& params) {
  return params.equal_scores + params.equal_by_chance * ChanceOf(num_posts);
}

double EqualOfAlike(double score, const EvidenceParams& params) {
  return params.equal_of_alike * std::max(0.0, score - params.alike_score);
}

/// By how much a better score must be better to say anything against this one.
double EqualScores(double score, std::size_t num_posts, const EvidenceParams& params) {
  return EqualByChance(num_posts, params) + EqualOfAlike(score, params);
}

/// Of that, what remains in a large cohort.
double RemainsEqual(double large_cohort_share, const EvidenceParams& params) {
  return 1.0 - large_cohort_share * (1.0 - params.equal_in_cohort);
}

/// By how much more than `equal` the first score is ahead of all others.
double Ahead(std::span<const double> scores, double equal) {
  const auto others = scores.subspan(1);
  const double second = others.empty() ? 0.0 : *std::ranges::max_element(others);
  return std::max(0.0, scores.front() - second - equal);
}

double FallAround(const QueryMatch& match, double score, const PlanarPose& pose) {
  constexpr PoseLimits kLimits;
  constexpr int kNumDirections = 8;
  double highest = 0.0;
  for (int i = 0; i < kNumDirections; ++i) {
    const double direction_rad = 2.0 * std::numbers::pi * i / kNumDirections;
    highest = std::max(
        highest,
        match.ScoreFromAbove({pose.x_m + kLimits.plane_m * std::cos(direction_rad),
                              pose.y_m + kLimits.plane_m * std::sin(direction_rad), pose.yaw_rad}));
  }
  const double turn_rad = kLimits.heading_deg * std::numbers::pi / 180.0;
  for (const double yaw_rad : {pose.yaw_rad - turn_rad, pose.yaw_rad + turn_rad}) {
    highest = std::max(highest, match.ScoreFromAbove({pose.x_m, pose.y_m, yaw_rad}));
  }
  return score - highest;
}

struct Mirrored {
  double score = 0.0;
  double with_inliers = 0.0;
};

/// The scores of the place's mirror image, laid on the query as well as it will.
Mirrored MirrorScore(QueryMatch& match, const Structure& query, const Structure& place,
                     const PlanarPose& pose) {
  constexpr std::size_t kNumHeadings = 4;
  const double ring_m = match.params().shortlist.bearing_ring_m;
  Structure mirrored = place;
  for (Post& post : mirrored.posts) post.y_cm = static_cast<std::int16_t>(-post.y_cm);
  // Mirrored across its own two axes where the query stands, and as the bearings say.
  std::vector<PlanarPose> guesses = {
      {pose.x_m, -pose.y_m, -pose.yaw_rad},
      {pose.x_m, -pose.y_m, WrapAngle(std::numbers::pi - pose.yaw_rad)}};
  for (const double yaw_rad : AgreeingHeadings(mirrored.posts, query.posts, ring_m, kNumHeadings)) {
    guesses.push_back({0.0, 0.0, yaw_rad});
  }
  match.SetPlace(mirrored);
  const StageParams& stage = match.params().verify.at_once;
  const PlanarPoints coarse(mirrored.posts, static_cast<std::size_t>(stage.num_posts));
  double best_coarse = 0.0;
  std::vector<Hypothesis> laid;
  std::vector<Hypothesis> scored;
  for (const PlanarPose& guess : guesses) {
    scored.push_back({.T_place_query = guess, .score = match.ScoreFromAbove(guess)});
    match.LayCoarsely(coarse, stage.steps, laid.emplace_back(Hypothesis{.T_place_query = guess}));
    best_coarse = std::max(best_coarse, laid.back().score);
  }
  const double hopeless_by = match.params().verify.hopeless_by;
  for (const Hypothesis& hypothesis : laid) {
    if (hypothesis.score < best_coarse - hopeless_by) continue;
    const PlanarPose settled = match.Settle(hypothesis.T_place_query);
    scored.push_back({.T_place_query = settled, .score = match.ScoreFromAbove(settled)});
  }
  Mirrored best;
  for (const Hypothesis& one : scored) best.score = std::max(best.score, one.score);
  const PostLines lines = match.LinesOf(mirrored);
  for (const Hypothesis& one : scored) {
    if (one.score < best.score - hopeless_by) continue;
    best.with_inliers = std::max(best.with_inliers,
                                 WithInliers(one.score, match.InlierRatio(lines, one.T_place_query),
                                             match.params().evidence));
  }
  return best;
}

/// What is seen first in each direction: nothing stands before it.
class FreeSpace {
 public:
  FreeSpace(std::span<const Post> posts, const EvidenceParams& params)
      : clear_m_(static_cast<float>(params.clear_m)),
        clear_share_(static_cast<float>(params.clear_share)) {
    first_m_.fill(std::numeric_limits<float>::infinity());
    for (const Post& post : posts) {
      const float x_m = static_cast<float>(post.x_cm) * 0.01F;
      const float y_m = static_cast<float>(post.y_cm) * 0.01F;
      const std::size_t sector = SectorOf(x_m, y_m);
      // A sector's neighbours, too: beams pass between posts.
      for (const std::size_t near : {sector + kNumSectors - 1, sector, sector + 1}) {
        float& first_m = first_m_[near % kNumSectors];
        first_m = std::min(first_m, std::sqrt(x_m * x_m + y_m * y_m));
      }
    }
  }

  /// Of another scan's posts in the directions in which anything is seen, the share that stand
  /// clearly before what is seen first.
  [[nodiscard]] double Contradicted(std::span<const Post> posts,
                                    const PlanarPose& T_free_posts) const {
    const auto cosine = static_cast<float>(std::cos(T_free_posts.yaw_rad));
    const auto sine = static_cast<float>(std::sin(T_free_posts.yaw_rad));
    int num_seen = 0;
    int num_contradicted = 0;
    for (const Post& post : posts) {
      const float given_x_m = static_cast<float>(post.x_cm) * 0.01F;
      const float given_y_m = static_cast<float>(post.y_cm) * 0.01F;
      const float x_m =
          cosine * given_x_m - sine * given_y_m + static_cast<float>(T_free_posts.x_m);
      const float y_m =
          sine * given_x_m + cosine * given_y_m + static_cast<float>(T_free_posts.y_m);
      const float range_m = std::sqrt(x_m * x_m + y_m * y_m);
      const float first_m = first_m_[SectorOf(x_m, y_m)];
      if (range_m < clear_m_ || !std::isfinite(first_m)) continue;
      ++num_seen;
      if (range_m < first_m * (1.0F - clear_share_) - clear_m_) ++num_contradicted;
    }
    return num_seen == 0 ? 0.0 : static_cast<double>(num_contradicted) / num_seen;
  }

  /// Of directions 10° wide, the share in which nothing is seen.
  [[nodiscard]] double Unseen() const {
    constexpr std::size_t kWidth = 5;
    std::size_t num_unseen = 0;
    for (auto first = first_m_.begin(); first != first_m_.end(); first += kWidth) {
      num_unseen += std::none_of(first, first + kWidth, [](float m) { return std::isfinite(m); });
    }
    return static_cast<double>(num_unseen * kWidth) / kNumSectors;
  }

 private:
  static constexpr std::size_t kNumSectors = 180;

  static std::size_t SectorOf(float x_m, float y_m) {
    return static_cast<std::size_t>(SectorFromRear(x_m, y_m, static_cast<int>(kNumSectors)));
  }

  float clear_m_, clear_share_;
  std::array<float, kNumSectors> first_m_{};
};

}  // namespace

Support SupportOf(QueryMatch& match, const Structure& query, const Structure& place,
                  const PlanarPose& T_place_query) {
  Support support{.score = match.ScoreFromAbove(T_place_query), .num_posts = query.posts.size()};
  support.sharpness = FallAround(match, support.score, T_place_query);
  const EvidenceParams& params = match.params().evidence;
  support.inliers = match.InlierRatio(match.LinesOf(place), T_place_query);
  const Mirrored mirrored = MirrorScore(match, query, place, T_place_query);
  support.over_mirror = support.score - mirrored.score;
  support.over_mirror_exactly =
      WithInliers(support.score, support.inliers, params) - mirrored.with_inliers;
  const FreeSpace of_place(place.posts, params);
  const FreeSpace of_query(query.posts, params);
  support.contradicted = of_place.Contradicted(query.posts, T_place_query) +
                         of_query.Contradicted(place.posts, Inverse(T_place_query));
  support.unseen = of_place.Unseen();
  support.unseen_by_query = of_query.Unseen();
  return support;
}

double SupportLogOdds(const Support& support, const EvidenceParams& params) {
  const double log_odds =
      params.bias + params.score * support.score +
      params.sharpness * std::min(support.sharpness, params.max_sharpness) +
      params.over_mirror * std::min(support.over_mirror, params.max_over_mirror) +
      params.contradicted * support.contradicted + params.chance * ChanceOf(support.num_posts) +
      params.inliers * std::min(support.inliers, params.max_inliers);
  if (params.inliers_share <= 0.0) return log_odds;
  return std::min(log_odds,
                  params.beyond_inliers * std::max(0.0, support.inliers - params.least_inliers));
}

double CohortShare(std::span<const double> scores, const EvidenceParams& params) {
  if (scores.empty()) return 0.0;
  const double least = params.cohort_share * scores.front();
  const auto num_alike =
      std::count_if(scores.begin() + 1, scores.end(), [&](double score) { return score >= least; });
  const double half = 0.5 * params.cohort_size;
  return std::clamp((static_cast<double>(num_alike) - half) / half, 0.0, 1.0);
}

double GenuineLogOdds(const Support& support, double of_cohort, const EvidenceParams& params) {
  const double over_beside =
      params.beside * std::max(0.0, support.sharpness - EqualByChance(support.num_posts, params));
  const double of_mirror =
      WithInliers(support.score, support.inliers, params) - support.over_mirror_exactly;
  const double over_mirror =
      params.rival *
      std::max(0.0, support.over_mirror_exactly -
                        params.equal_of_mirror * EqualScores(of_mirror, support.num_posts, params));
  return std::min({SupportLogOdds(support, params) + of_cohort, over_mirror, over_beside});
}

double MoreOfTurned(double score, double score_by_posts, std::size_t num_posts,
                    double large_cohort_share, const EvidenceParams& params) {
  return large_cohort_share * (1.0 - params.equal_in_cohort) * EqualByChance(num_posts, params) +
         EqualOfAlike(score_by_posts, params) - EqualOfAlike(score, params);
}

double RivalryLogOdds(double better_score, double score, std::size_t num_posts,
                      const EvidenceParams& params) {
  return params.rival * std::max(0.0, better_score - score - EqualScores(score, num_posts, params));
}

double RivalryLogOddsInARow(double better_score, double score, std::size_t num_posts,
                            const EvidenceParams& params) {
  return params.rival * std::max(0.0, better_score - score - EqualScores(score, num_posts, params) -
                                          params.shared_in_a_row);
}

std::vector<double> Shares(std::span<const double> scores, std::size_t num_posts,
                           const EvidenceParams& of_any, double large_cohort_share) {
  std::vector<double> shares(scores.begin(), scores.end());
  if (shares.empty()) return shares;
  EvidenceParams params = of_any;
  const double remains = RemainsEqual(large_cohort_share, params);
  params.equal_scores *= remains;
  params.equal_by_chance *= remains;
  const double best = *std::max_element(scores.begin(), scores.end());
  double sum = 0.0;
  for (double& share : shares) {
    share = std::exp(-RivalryLogOdds(best, share, num_posts, params));
    sum += share;
  }
  for (double& share : shares) share /= sum;
  return shares;
}

std::vector<double> Confidences(std::span<const double> scores, const Support& support,
                                double cohort_share, const EvidenceParams& params,
                                double large_cohort_share,
                                std::span<const double> cautious_scores) {
  if (scores.empty()) return {};
  if (cautious_scores.empty()) cautious_scores = scores;
  const double of_lead =
      std::min(large_cohort_share * params.cohort_lead,
               params.rival * Ahead(cautious_scores, RemainsEqual(large_cohort_share, params) *
                                                         EqualByChance(support.num_posts, params)));
  const auto read = [&](std::span<const double> some, const EvidenceParams& by) {
    std::vector<double> confidences = Shares(some, support.num_posts, by, large_cohort_share);
    const double of_cohort = by.cohort_surely * cohort_share + of_lead;
    const double genuine = Logistic(GenuineLogOdds(support, of_cohort, by));
    for (double& confidence : confidences) confidence *= genuine;
    return confidences;
  };
  std::vector<double> cautious = read(cautious_scores, params);
  EvidenceParams literally = params;
  literally.cohort_surely = params.cohort;
  literally.equal_scores = literally.equal_by_chance = literally.equal_of_alike = 0.0;
  const std::vector<double> literal = read(scores, literally);
  const double more = literal.front() - cautious.front();
  const double told = std::min(literal.front(), params.undecided) - cautious.front();
  if (more > 0.0 && told > 0.0) {
    for (std::size_t i = 0; i < cautious.size(); ++i) {
      cautious[i] += told / more * (literal[i] - cautious[i]);
    }
  }
  return cautious;
}

bool ExplainsLittle(double score, const Support& support, const EvidenceParams& params) {
  return score < params.explaining_score && support.unseen_by_query <= params.max_unseen;
}

double Logistic(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

}  // namespace scanloc
