#include "scanloc/core/structural/verify.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "structural/horizon.hpp"

namespace scanloc {
namespace {

constexpr float kCoarseCell_m = 1.0F;
constexpr float kFineCell_m = 0.5F;

bool Better(const Hypothesis& a, const Hypothesis& b) {
  return std::pair(-a.score, a.place) < std::pair(-b.score, b.place);
}

constexpr RegisterOptions kCoarse{.num_iterations = 6, .wide_m = 3.0, .narrow_m = 1.5};
constexpr RegisterOptions kFine{.num_iterations = 10, .wide_m = 1.5, .narrow_m = 0.7};

/// Lays each place's posts on the query's, so that one field does for all.
void CoarsePass(const PlanarPoints& query, PlaceStructures& places, const SearchControl& control,
                const VerifyOptions& options, std::vector<Hypothesis>& hypotheses) {
  DistanceField query_field(kCoarseCell_m);
  query_field.Fill(query);
  PlanarPoints place;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    if (control.IsOver()) {
      hypotheses.resize(i);
      break;
    }
    Hypothesis& hypothesis = hypotheses[i];
    if (i == 0 || hypothesis.place != hypotheses[i - 1].place) {
      place = PlanarPoints(places.Posts(hypothesis.place),
                           static_cast<std::size_t>(options.num_coarse_points));
    }
    const PlanarPose T_query_place =
        Register(query_field, place, Inverse(hypothesis.T_place_query), kCoarse);
    hypothesis.T_place_query = Inverse(T_query_place);
    hypothesis.score = Overlap(query_field, place, T_query_place);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(), Better);
}

/// The best hypotheses, few from each spot.
std::vector<Hypothesis> Select(const std::vector<Hypothesis>& hypotheses, PlaceStructures& places,
                               const VerifyOptions& options) {
  std::vector<Hypothesis> selected;
  std::vector<Eigen::Vector2d> positions;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (static_cast<int>(selected.size()) >= options.num_fine) break;
    const Eigen::Vector2d position =
        places.PositionInMap(hypothesis.place, hypothesis.T_place_query);
    const auto num_near =
        std::count_if(positions.begin(), positions.end(), [&](const Eigen::Vector2d& other) {
          return (other - position).norm() < options.rival_radius_m;
        });
    if (num_near >= options.max_fine_per_spot) continue;
    selected.push_back(hypothesis);
    positions.push_back(position);
  }
  return selected;
}

}  // namespace

std::vector<Hypothesis> Verify(std::span<const Post> query_posts,
                               std::vector<Hypothesis> hypotheses, PlaceStructures& places,
                               const SearchControl& control, const VerifyOptions& options) {
  if (query_posts.empty() || hypotheses.empty()) return {};
  const PlanarPoints query(query_posts);
  CoarsePass(query, places, control, options, hypotheses);
  std::vector<Hypothesis> selected = Select(hypotheses, places, options);

  DistanceField query_field(kFineCell_m);
  query_field.Fill(query);
  DistanceField place_field(kFineCell_m);
  const Horizon query_horizon(query_posts);
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (i > 0 && control.IsOver()) {
      selected.resize(i);
      break;
    }
    Hypothesis& hypothesis = selected[i];
    const std::span<const Post> posts = places.Posts(hypothesis.place);
    place_field.Fill(PlanarPoints(posts));
    hypothesis.T_place_query = Register(place_field, query, hypothesis.T_place_query, kFine);
    const PlanarPose T_query_place = Inverse(hypothesis.T_place_query);
    const PlanarPoints in_sight(query_horizon.Within(posts, T_query_place));
    hypothesis.score = std::sqrt(Overlap(place_field, query, hypothesis.T_place_query) *
                                 Overlap(query_field, in_sight, T_query_place));
  }
  std::stable_sort(selected.begin(), selected.end(), Better);
  return selected;
}

}  // namespace scanloc
