#include "structural/query_match.hpp"

#include <cmath>

namespace scanloc {
namespace {

DistanceField FieldOf(const AutoParams& params, double cell_m) {
  return {cell_m, params.posts.reach_m, params.verify.cutoff_m};
}

}  // namespace

QueryMatch::QueryMatch(std::span<const Post> query, const AutoParams& params)
    : params_(params),
      query_(query),
      few_(query, static_cast<std::size_t>(params.verify.fine.num_posts)),
      horizon_(query, params.verify.horizon_margin_m),
      coarse_(FieldOf(params, params.verify.coarse_cell_m)),
      fine_(FieldOf(params, params.verify.fine_cell_m)),
      place_field_(fine_) {
  coarse_.Fill(query_);
  fine_.Fill(query_);
}

void QueryMatch::LayCoarsely(const PlanarPoints& place, const RegistrationParams& steps,
                             Hypothesis& hypothesis) const {
  const PlanarPose T_query_place =
      Register(coarse_, place, Inverse(hypothesis.T_place_query), steps);
  hypothesis.T_place_query = Inverse(T_query_place);
  hypothesis.score = Overlap(coarse_, place, T_query_place, params_.verify.overlap_m);
}

void QueryMatch::SetPlace(std::span<const Post> posts) {
  place_ = PlanarPoints(posts);
  place_field_.Fill(place_);
}

PlanarPose QueryMatch::Settle(const PlanarPose& guess) const {
  // Where a part of the posts has settled the whole is there in a step or two.
  const RegistrationParams& steps = params_.verify.fine.steps;
  const PlanarPose settled = Register(place_field_, few_, guess, steps);
  if (few_.size() == query_.size()) return settled;
  return Register(place_field_, query_, settled,
                  {.num_iterations = 0, .narrow_m = steps.narrow_m, .max_settling = 2});
}

double QueryMatch::Score(const PlanarPose& T_place_query) const {
  const double overlap_m = params_.verify.overlap_m;
  return std::sqrt(Overlap(place_field_, query_, T_place_query, overlap_m) *
                   OverlapWithin(horizon_, fine_, place_, Inverse(T_place_query), overlap_m));
}

Eigen::Matrix3d QueryMatch::Information(const PlanarPose& T_place_query) const {
  return scanloc::Information(place_field_, query_, T_place_query,
                              params_.verify.fine.steps.narrow_m);
}

void QueryMatch::LayFinely(std::span<const Post> place, Hypothesis& hypothesis) {
  SetPlace(place);
  hypothesis.T_place_query = Settle(hypothesis.T_place_query);
  hypothesis.score = Score(hypothesis.T_place_query);
}

}  // namespace scanloc
