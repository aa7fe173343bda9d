#include "scanloc/core/structural/verify.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scan/prefetch.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "structural/query_match.hpp"

namespace scanloc {
namespace {

bool Better(const Hypothesis& a, const Hypothesis& b) {
  return std::pair(-a.score, a.place) < std::pair(-b.score, b.place);
}

/// Registers each place's posts, at most so many, on the query's, and scores by their overlap.
void Lay(const QueryMatch& query, PlaceStructures& places, const StageParams& stage,
         const SearchControl& control, std::vector<Hypothesis>& hypotheses) {
  PlanarPoints place;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    if (control.IsOver()) {
      hypotheses.resize(i);
      break;
    }
    Hypothesis& hypothesis = hypotheses[i];
    if (i == 0 || hypothesis.place != hypotheses[i - 1].place) {
      place.Assign(places.Of(hypothesis.place).posts, static_cast<std::size_t>(stage.num_posts));
    }
    if (i + 1 < hypotheses.size() && hypotheses[i + 1].place != hypothesis.place) {
      const std::vector<Post>& next = places.Of(hypotheses[i + 1].place).posts;
      Prefetch(next.data(), next.size() * sizeof(Post));
    }
    query.LayCoarsely(place, stage.steps, hypothesis);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(), Better);
}

/// Of hypotheses, best first, those that have not met a better one of their place.
std::vector<Hypothesis> Separate(const std::vector<Hypothesis>& hypotheses,
                                 std::size_t max_hypotheses, const VerificationParams& params) {
  std::vector<Hypothesis> separate;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (separate.size() >= max_hypotheses) break;
    if (!HasMet(hypothesis, separate, params)) separate.push_back(hypothesis);
  }
  return separate;
}

/// Lays all places on the query, so that one field does for all: first a few posts of each and few
/// steps, which most hypotheses do not survive.
void CoarsePass(const QueryMatch& query, PlaceStructures& places, const SearchControl& control,
                std::vector<Hypothesis>& hypotheses) {
  const VerificationParams& params = query.params().verify;
  Lay(query, places, params.first, control, hypotheses);
  hypotheses = Separate(hypotheses, static_cast<std::size_t>(params.num_survivors), params);
  std::vector<Hypothesis> survivors = hypotheses;
  Lay(query, places, params.second, control, survivors);
  // Late before the second round began: the first round's word stands.
  if (!survivors.empty()) hypotheses = Separate(survivors, survivors.size(), params);
}

bool AreOfOneSpot(const UprightPose& a, const UprightPose& b, const SelectionParams& params) {
  return (a.plane_m - b.plane_m).norm() < params.spot_radius_m &&
         std::abs(a.height_m - b.height_m) < params.spot_height_m &&
         std::abs(WrapAngle(a.heading_rad - b.heading_rad)) < params.spot_heading_rad;
}

/// The best hypotheses, few from each spot.
std::vector<Hypothesis> Select(const std::vector<Hypothesis>& hypotheses, PlaceStructures& places,
                               const SelectionParams& params) {
  std::vector<Hypothesis> selected;
  std::vector<UprightPose> poses;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (static_cast<int>(selected.size()) >= params.num_hypotheses) break;
    const UprightPose pose = places.Upright(hypothesis.place, hypothesis.T_place_query);
    const auto num_near = std::count_if(poses.begin(), poses.end(), [&](const UprightPose& other) {
      return AreOfOneSpot(pose, other, params);
    });
    if (num_near >= params.max_per_spot) continue;
    selected.push_back(hypothesis);
    poses.push_back(pose);
  }
  return selected;
}

}  // namespace

bool HasMet(const Hypothesis& hypothesis, std::span<const Hypothesis> others,
            const VerificationParams& params) {
  return std::any_of(others.begin(), others.end(), [&](const Hypothesis& other) {
    if (hypothesis.place != other.place) return false;
    const PlanarPose& a = hypothesis.T_place_query;
    const PlanarPose& b = other.T_place_query;
    return Eigen::Vector2d(a.x_m - b.x_m, a.y_m - b.y_m).norm() < params.met_m &&
           std::abs(WrapAngle(a.yaw_rad - b.yaw_rad)) < params.met_rad;
  });
}

std::vector<Hypothesis> Verify(QueryMatch& query, std::vector<Hypothesis> hypotheses,
                               PlaceStructures& places, const SearchControl& control,
                               const SelectionParams& selection) {
  if (hypotheses.empty()) return {};
  CoarsePass(query, places, control, hypotheses);
  std::vector<Hypothesis> selected = Select(hypotheses, places, selection);
  if (selected.empty()) return {};
  const double least_coarse = selected.front().score - query.params().verify.hopeless_by;
  double least_fine = 1.0;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (i > 0 && control.IsOver()) {
      selected.resize(i);
      break;
    }
    if (selected[i].score >= least_coarse) {
      query.LayFinely(places.Of(selected[i].place), selected[i]);
      least_fine = std::min(least_fine, selected[i].score);
    } else {
      // No rival: told behind those that are.
      selected[i].score = std::min(selected[i].score, least_fine);
    }
  }
  std::stable_sort(selected.begin(), selected.end(), Better);
  return selected;
}

}  // namespace scanloc
