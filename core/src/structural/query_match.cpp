#include "structural/query_match.hpp"

#include <cmath>

namespace scanloc {
namespace {

constexpr float kCoarseCell_m = 1.0F;
constexpr float kFineCell_m = 0.5F;

constexpr RegisterOptions kFine{
    .num_iterations = 10, .wide_m = 1.5, .narrow_m = 0.7, .max_settling = 20};

}  // namespace

QueryMatch::QueryMatch(std::span<const Post> query)
    : query_(query),
      horizon_(query),
      coarse_(kCoarseCell_m),
      fine_(kFineCell_m),
      place_field_(kFineCell_m) {
  coarse_.Fill(query_);
  fine_.Fill(query_);
}

void QueryMatch::LayCoarsely(const PlanarPoints& place, const RegisterOptions& steps,
                             Hypothesis& hypothesis) const {
  const PlanarPose T_query_place =
      Register(coarse_, place, Inverse(hypothesis.T_place_query), steps);
  hypothesis.T_place_query = Inverse(T_query_place);
  hypothesis.score = Overlap(coarse_, place, T_query_place);
}

void QueryMatch::SetPlace(std::span<const Post> posts) {
  place_ = posts;
  place_field_.Fill(PlanarPoints(posts));
}

PlanarPose QueryMatch::Settle(const PlanarPose& guess) const {
  return Register(place_field_, query_, guess, kFine);
}

double QueryMatch::Score(const PlanarPose& T_place_query) const {
  const PlanarPose T_query_place = Inverse(T_place_query);
  const PlanarPoints in_sight(horizon_.Within(place_, T_query_place));
  return std::sqrt(Overlap(place_field_, query_, T_place_query) *
                   Overlap(fine_, in_sight, T_query_place));
}

void QueryMatch::LayFinely(std::span<const Post> place, Hypothesis& hypothesis) {
  SetPlace(place);
  hypothesis.T_place_query = Settle(hypothesis.T_place_query);
  hypothesis.score = Score(hypothesis.T_place_query);
}

}  // namespace scanloc
