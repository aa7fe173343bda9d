#include "scanloc/core/structural/verify.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scanloc/core/scan/pose.hpp"
#include "structural/query_match.hpp"

namespace scanloc {
namespace {

bool Better(const Hypothesis& a, const Hypothesis& b) {
  return std::pair(-a.score, a.place) < std::pair(-b.score, b.place);
}

/// Measured on a town seen by 32 rays from two lanes off, driving the other way: as many right as
/// with all posts and six steps for every hypothesis.
constexpr CoarseStage kFirst{80, {.num_iterations = 3, .wide_m = 3.0, .narrow_m = 2.4}};
constexpr CoarseStage kSecond{250, {.num_iterations = 4, .wide_m = 2.2, .narrow_m = 1.5}};
/// Hypotheses that the second stage looks at.
constexpr std::size_t kNumSurvivors = 160;

/// Registers each place's posts, at most so many, on the query's, and scores by their overlap.
void Lay(const QueryMatch& query, PlaceStructures& places, const CoarseStage& stage,
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
    query.LayCoarsely(place, stage.steps, hypothesis);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(), Better);
}

/// Lays all places on the query, so that one field does for all: first a few posts of each and few
/// steps, which most hypotheses do not survive.
void CoarsePass(const QueryMatch& query, PlaceStructures& places, const SearchControl& control,
                std::vector<Hypothesis>& hypotheses) {
  Lay(query, places, kFirst, control, hypotheses);
  if (hypotheses.size() > kNumSurvivors) hypotheses.resize(kNumSurvivors);
  std::vector<Hypothesis> survivors = hypotheses;
  Lay(query, places, kSecond, control, survivors);
  // Late before the second round began: the first round's word stands.
  if (!survivors.empty()) hypotheses = std::move(survivors);
}

bool AreOfOneSpot(const UprightPose& a, const UprightPose& b, const VerifyOptions& options) {
  return (a.plane_m - b.plane_m).norm() < options.spot_radius_m &&
         std::abs(a.height_m - b.height_m) < options.spot_height_m &&
         std::abs(WrapAngle(a.heading_rad - b.heading_rad)) < options.spot_heading_rad;
}

/// The best hypotheses, few from each spot.
std::vector<Hypothesis> Select(const std::vector<Hypothesis>& hypotheses, PlaceStructures& places,
                               const VerifyOptions& options) {
  std::vector<Hypothesis> selected;
  std::vector<UprightPose> poses;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (static_cast<int>(selected.size()) >= options.num_fine) break;
    const UprightPose pose = places.Upright(hypothesis.place, hypothesis.T_place_query);
    const auto num_near = std::count_if(poses.begin(), poses.end(), [&](const UprightPose& other) {
      return AreOfOneSpot(pose, other, options);
    });
    if (num_near >= options.max_fine_per_spot) continue;
    selected.push_back(hypothesis);
    poses.push_back(pose);
  }
  return selected;
}

}  // namespace

std::vector<Hypothesis> Verify(QueryMatch& query, std::vector<Hypothesis> hypotheses,
                               PlaceStructures& places, const SearchControl& control,
                               const VerifyOptions& options) {
  if (hypotheses.empty()) return {};
  CoarsePass(query, places, control, hypotheses);
  std::vector<Hypothesis> selected = Select(hypotheses, places, options);
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (i > 0 && control.IsOver()) {
      selected.resize(i);
      break;
    }
    query.LayFinely(places.Posts(selected[i].place), selected[i]);
  }
  std::stable_sort(selected.begin(), selected.end(), Better);
  return selected;
}

}  // namespace scanloc
