#include "structural/query_match.hpp"

#include <algorithm>
#include <cmath>

namespace scanloc {
namespace {

DistanceField FieldOf(const AutoParams& params, double cell_m) {
  return {cell_m, params.posts.reach_m, params.verify.cutoff_m};
}

}  // namespace

MatchGrids::MatchGrids(const AutoParams& params)
    : coarse(FieldOf(params, params.verify.coarse_cell_m)),
      fine(FieldOf(params, params.verify.fine_cell_m)),
      place(fine),
      heights(params.posts),
      place_heights(params.posts) {}

QueryMatch::QueryMatch(const Structure& query, const AutoParams& params, double sensor_height_m,
                       MatchGrids& grids)
    : params_(params),
      sensor_height_m_(sensor_height_m),
      query_(query.posts),
      few_(query.posts, static_cast<std::size_t>(params.verify.fine.num_posts)),
      lines_(LinesOf(query)),
      horizon_(query.posts, params.verify.horizon_margin_m),
      grids_(grids),
      knows_heights_(params.verify.heights_share > 0.0 && KnowsHeights(query)) {
  grids_.coarse.Fill(query_);
  grids_.fine.Fill(query_);
  if (knows_heights_) grids_.heights.Fill(query_, query.height_m);
}

bool QueryMatch::KnowsHeights(const Structure& structure) const {
  return std::abs(structure.height_m - sensor_height_m_) <= params_.posts.cell_m;
}

PostLines QueryMatch::LinesOf(const Structure& place) const {
  const bool is_asked = params_.evidence.inliers_share > 0.0;
  return {is_asked ? std::span<const Post>(place.posts) : std::span<const Post>(),
          params_.posts.cell_m};
}

double QueryMatch::InlierRatio(const PostLines& place, const PlanarPose& T_place_query) const {
  return lines_.InlierRatioOn(place, T_place_query, params_.evidence.inlier_m);
}

void QueryMatch::LayCoarsely(const PlanarPoints& place, const RegistrationParams& steps,
                             Hypothesis& hypothesis) const {
  const PlanarPose T_query_place =
      Register(grids_.coarse, place, Inverse(hypothesis.T_place_query), steps);
  hypothesis.T_place_query = Inverse(T_query_place);
  hypothesis.score = Overlap(grids_.coarse, place, T_query_place, params_.verify.overlap_m);
}

void QueryMatch::SetPlace(const Structure& place) {
  place_.Assign(place.posts);
  grids_.place.Fill(place_);
  if (!knows_heights_) return;
  knows_place_heights_ = KnowsHeights(place);
  grids_.place_heights.Fill(place_, place.height_m);
}

PlanarPose QueryMatch::Settle(const PlanarPose& guess) const {
  // Where a part of the posts has settled the whole is there in a step or two.
  const RegistrationParams& steps = params_.verify.fine.steps;
  const PlanarPose settled = Register(grids_.place, few_, guess, steps);
  if (few_.size() == query_.size()) return settled;
  return Register(grids_.place, query_, settled,
                  {.num_iterations = 0, .narrow_m = steps.narrow_m, .max_settling = 2});
}

double QueryMatch::ScoreFromAbove(const PlanarPose& T_place_query) const {
  const double overlap_m = params_.verify.overlap_m;
  return std::sqrt(Overlap(grids_.place, query_, T_place_query, overlap_m) *
                   OverlapWithin(horizon_, grids_.fine, place_, Inverse(T_place_query), overlap_m));
}

double QueryMatch::Score(const PlanarPose& T_place_query) const {
  // What stands at the same heights is mostly by so much more than what does seen from above.
  constexpr double kUsuallyMore = 0.1;
  const double from_above = ScoreFromAbove(T_place_query);
  const double share = params_.verify.heights_share;
  const double unknown = std::min(1.0, from_above + share * kUsuallyMore);
  if (!knows_heights_) return unknown;
  const double by_height =
      std::sqrt(grids_.place_heights.Overlap(query_, T_place_query, nullptr) *
                grids_.heights.Overlap(place_, Inverse(T_place_query), &horizon_));
  const double both = (1.0 - share) * from_above + share * by_height;
  return knows_place_heights_ ? both : std::max(both, unknown);
}

Eigen::Matrix3d QueryMatch::Information(const PlanarPose& T_place_query) const {
  return scanloc::Information(grids_.place, query_, T_place_query,
                              params_.verify.fine.steps.narrow_m);
}

void QueryMatch::LayFinely(const Structure& place, Hypothesis& hypothesis) {
  SetPlace(place);
  hypothesis.T_place_query = Settle(hypothesis.T_place_query);
  hypothesis.score = Score(hypothesis.T_place_query);
}

}  // namespace scanloc
