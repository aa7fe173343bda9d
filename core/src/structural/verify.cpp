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

struct CoarseStage {
  std::size_t num_points;  ///< posts of a place, at most
  RegisterOptions steps;
};
/// Measured on a town seen by 32 rays from two lanes off, driving the other way: as many right as
/// with all posts and six steps for every hypothesis.
constexpr CoarseStage kFirst{80, {.num_iterations = 3, .wide_m = 3.0, .narrow_m = 2.4}};
constexpr CoarseStage kSecond{250, {.num_iterations = 4, .wide_m = 2.2, .narrow_m = 1.5}};
/// Hypotheses that the second stage looks at.
constexpr std::size_t kNumSurvivors = 160;
constexpr RegisterOptions kFine{.num_iterations = 10, .wide_m = 1.5, .narrow_m = 0.7};

/// Registers each place's posts, at most so many, on the query's, and scores by their overlap.
void Lay(const DistanceField& query_field, PlaceStructures& places, const CoarseStage& stage,
         const SearchControl& control, std::vector<Hypothesis>& hypotheses) {
  PlanarPoints place;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    if (control.IsOver()) {
      hypotheses.resize(i);
      break;
    }
    Hypothesis& hypothesis = hypotheses[i];
    if (i == 0 || hypothesis.place != hypotheses[i - 1].place) {
      place = PlanarPoints(places.Posts(hypothesis.place), stage.num_points);
    }
    const PlanarPose T_query_place =
        Register(query_field, place, Inverse(hypothesis.T_place_query), stage.steps);
    hypothesis.T_place_query = Inverse(T_query_place);
    hypothesis.score = Overlap(query_field, place, T_query_place);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(), Better);
}

/// Lays all places on the query, so that one field does for all: first a few posts of each and few
/// steps, which most hypotheses do not survive.
void CoarsePass(const PlanarPoints& query, PlaceStructures& places, const SearchControl& control,
                std::vector<Hypothesis>& hypotheses) {
  DistanceField query_field(kCoarseCell_m);
  query_field.Fill(query);
  Lay(query_field, places, kFirst, control, hypotheses);
  if (hypotheses.size() > kNumSurvivors) hypotheses.resize(kNumSurvivors);
  std::vector<Hypothesis> survivors = hypotheses;
  Lay(query_field, places, kSecond, control, survivors);
  // Late before the second round began: the first round's word stands.
  if (!survivors.empty()) hypotheses = std::move(survivors);
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
  CoarsePass(query, places, control, hypotheses);
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
