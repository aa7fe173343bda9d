#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"

// What else a query may be at the place that explains it best: looked at for every query, so that
// no rival is missed because the shortlist did not hold it. And what spots are weighed by: how
// exactly posts lie there, and where many are alike, the best of them with the places beside: a
// place and a query a metre apart do not see the same, which makes as much of a score as the stock
// of an aisle does.

namespace scanloc {
namespace {

constexpr int kMaxLevels = 100;

/// The pose turned on the spot, and turned by half about the middle of what the place sees: where a
/// room is symmetrical it looks the same from there.
std::vector<PlanarPose> TurnedGuesses(std::span<const Post> place, const PlanarPose& pose) {
  std::vector<PlanarPose> guesses;
  for (int quarter = 1; quarter < 4; ++quarter) {
    guesses.push_back(
        {pose.x_m, pose.y_m, WrapAngle(pose.yaw_rad + quarter * std::numbers::pi / 2.0)});
  }
  const auto [left, right] = std::minmax_element(
      place.begin(), place.end(), [](const Post& a, const Post& b) { return a.x_cm < b.x_cm; });
  const auto [low, high] = std::minmax_element(
      place.begin(), place.end(), [](const Post& a, const Post& b) { return a.y_cm < b.y_cm; });
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const Post& post : place) mean_m += Eigen::Vector2d(post.x_cm, post.y_cm) * 0.01;
  mean_m /= std::max<double>(1.0, static_cast<double>(place.size()));
  Eigen::Vector2d middle_m = mean_m;
  if (!place.empty()) {
    middle_m = {(left->x_cm + right->x_cm) * 0.005, (low->y_cm + high->y_cm) * 0.005};
  }
  for (const Eigen::Vector2d& about_m : {middle_m, mean_m}) {
    guesses.push_back({2.0 * about_m.x() - pose.x_m, 2.0 * about_m.y() - pose.y_m,
                       WrapAngle(pose.yaw_rad + std::numbers::pi)});
  }
  return guesses;
}

/// The pose a little ahead, behind and to either side: pillars and uprights stand at equal
/// distances.
std::vector<PlanarPose> ShiftedGuesses(const PlanarPose& pose, const RivalParams& params) {
  std::vector<PlanarPose> guesses;
  for (const double distance_m : {params.near_shift_m, params.far_shift_m}) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      const double direction_rad = pose.yaw_rad + quarter * std::numbers::pi / 2.0;
      guesses.push_back({pose.x_m + distance_m * std::cos(direction_rad),
                         pose.y_m + distance_m * std::sin(direction_rad), pose.yaw_rad});
    }
  }
  return guesses;
}

}  // namespace

std::vector<double> AutoSearch::Levels() const {
  std::vector<double> levels_m;
  const double step_m =
      std::max(map_.params.automatic.rivals.level_step_m, (highest_m_ - lowest_m_) / kMaxLevels);
  for (int i = 0; lowest_m_ + i * step_m < highest_m_ + step_m; ++i) {
    levels_m.push_back(lowest_m_ + i * step_m);
  }
  return levels_m;
}

std::vector<Hypothesis> AutoSearch::HypothesesAlong(const Structure& query, const Pose& T_map_query,
                                                    std::int32_t place,
                                                    const SearchControl& control) const {
  const RivalParams& params = map_.params.automatic.rivals;
  const Eigen::Vector3d ahead = T_map_query.linear().col(0);
  std::vector<Hypothesis> along;
  for (double along_m = params.along_step_m; along_m <= params.along_m;
       along_m += params.along_step_m) {
    for (const double signed_m : {along_m, -along_m}) {
      Pose T_map_there = T_map_query;
      T_map_there.pretranslate(signed_m * ahead);
      const auto there = HypothesisAt(query, T_map_there, control);
      if (there && there->place != place) along.push_back(*there);
    }
  }
  return along;
}

std::vector<Hypothesis> AutoSearch::VerifyRivals(QueryMatch& match, const Structure& query,
                                                 PayloadView& payload, const Hypothesis& best,
                                                 const SearchControl& control) const {
  const auto structure_of = [&](std::int32_t number) -> const Structure& {
    return payload.StructureOf(static_cast<std::size_t>(number));
  };
  const Structure& place = structure_of(best.place);
  const RivalParams& params = match.params().rivals;
  const StageParams& stage = match.params().verify.at_once;
  const PlanarPoints coarse(place.posts, static_cast<std::size_t>(stage.num_posts));
  std::vector<Hypothesis> rivals;
  match.SetPlace(place);
  Hypothesis again = best;
  match.LayCoarsely(coarse, stage.steps, again);
  const double least_coarse = again.score - match.params().verify.hopeless_by;
  const std::vector<PlanarPose> turned = TurnedGuesses(place.posts, best.T_place_query);
  for (const PlanarPose& guess : turned) {
    Hypothesis rival{best.place, guess};
    match.LayCoarsely(coarse, stage.steps, rival);
    if (rival.score < least_coarse) continue;
    rival.T_place_query = match.Settle(rival.T_place_query);
    rival.score = match.Score(rival.T_place_query);
    rivals.push_back(rival);
  }
  for (const PlanarPose& guess : ShiftedGuesses(best.T_place_query, params)) {
    Hypothesis& rival = rivals.emplace_back(Hypothesis{best.place, match.Settle(guess)});
    rival.score = match.Score(rival.T_place_query);
  }
  const auto lay = [&](Hypothesis hypothesis) {
    match.LayFinely(structure_of(hypothesis.place), hypothesis);
    rivals.push_back(hypothesis);
  };
  // Where a turned or shifted pose has a place nearer to it, that one sees it from its own side.
  const Pose T_map_best = PoseInMap(query, best);
  const std::size_t num_at_place = rivals.size();
  for (std::size_t i = 0; i < num_at_place; ++i) {
    if (rivals[i].score < params.worth_a_look * best.score) continue;
    const Pose T_map_rival = PoseInMap(query, rivals[i]);
    if (!MissOf(DifferenceOf(T_map_best, T_map_rival, up_)).any()) continue;
    const auto there = HypothesisAt(query, T_map_rival, control);
    if (there && there->place != best.place) lay(*there);
  }
  std::vector<Hypothesis> around = HypothesesAlong(query, T_map_best, best.place, control);
  // Turned about the middle of a hall, it may be farther off than this place sees.
  for (const PlanarPose& guess : turned) {
    const auto there = HypothesisAt(query, PoseInMap(query, {best.place, guess}), control);
    if (there && there->place != best.place) around.push_back(*there);
  }
  for (const Hypothesis& there : around) {
    payload.WillUseStructure(static_cast<std::size_t>(there.place));
  }
  payload.Fetch();
  PlanarPoints posts;
  for (Hypothesis& there : around) {
    posts.Assign(structure_of(there.place).posts, static_cast<std::size_t>(stage.num_posts));
    match.LayCoarsely(posts, stage.steps, there);
    if (there.score >= least_coarse) lay(there);
  }
  std::int32_t last = best.place;
  for (const double level_m : levels_m_) {
    Pose T_map_above = T_map_best;
    const double rise_m = level_m - T_map_best.translation().dot(up_);
    T_map_above.pretranslate(rise_m * up_);
    const auto above = HypothesisAt(query, T_map_above, control);
    if (!above || above->place == last) continue;
    last = above->place;
    const PoseDifference off =
        DifferenceOf(T_map_best, map_.places[static_cast<std::size_t>(last)].T_map_place, up_);
    if (off.plane_m >= params.above_radius_m || off.height_m <= PoseLimits{}.height_m) continue;
    lay(*above);
    // As it is, too: along a corridor it may settle somewhere else.
    Hypothesis& still = rivals.emplace_back(*above);
    still.score = match.Score(still.T_place_query);
  }
  return rivals;
}

double AutoSearch::InlierRatio(const QueryMatch& match, PlaceStructures& places,
                               const Hypothesis& hypothesis, Looked& looked) {
  return ScoreOf(hypothesis, looked.inliers, [&] {
    auto lines = looked.lines.find(hypothesis.place);
    if (lines == looked.lines.end()) {
      const Structure& place = places.Of(hypothesis.place);
      lines = looked.lines.emplace(hypothesis.place, match.LinesOf(place)).first;
    }
    return match.InlierRatio(lines->second, hypothesis.T_place_query);
  });
}

void AutoSearch::ScoreWithInliers(const QueryMatch& match, PlaceStructures& places, Looked& looked,
                                  std::vector<Spot>& spots) const {
  const EvidenceParams& params = match.params().evidence;
  if (params.inliers_share <= 0.0) return;
  const double least = spots.front().hypothesis.score - match.params().verify.hopeless_by;
  for (Spot& spot : spots) {
    const Hypothesis& hypothesis = spot.hypothesis;
    const double inliers =
        hypothesis.score < least ? 0.0 : InlierRatio(match, places, hypothesis, looked);
    spot.score = WithInliers(hypothesis.score, inliers, params);
  }
  SortByScore(spots);
}

std::vector<std::int32_t> AutoSearch::PlacesBeside(const Spot& spot, int num_places,
                                                   const SearchControl& control) const {
  std::vector<std::int32_t> beside;
  std::vector<bool> taken =
      control.excluded != nullptr ? *control.excluded : std::vector<bool>(map_.places.size());
  taken[static_cast<std::size_t>(spot.hypothesis.place)] = true;
  while (static_cast<int>(beside.size()) < num_places) {
    const auto nearest = places_.Nearest(spot.T_map_query.translation(), &taken);
    if (!nearest) break;
    const PoseDifference off =
        DifferenceOf(spot.T_map_query, map_.places[*nearest].T_map_place, up_);
    if (off.plane_m > map_.params.automatic.rivals.above_radius_m ||
        off.height_m > PoseLimits{}.height_m) {
      break;
    }
    taken[*nearest] = true;
    beside.push_back(static_cast<std::int32_t>(*nearest));
  }
  return beside;
}

Structure AutoSearch::MergedBeside(PlaceStructures& places, const Spot& spot, int num_beside,
                                   const SearchControl& control) const {
  const std::int32_t own = spot.hypothesis.place;
  Structure merged = places.Of(own);
  const Pose T_own_map = T_map_level(static_cast<std::size_t>(own)).inverse();
  for (const std::int32_t number : PlacesBeside(spot, num_beside, control)) {
    const Pose T_own_beside = T_own_map * T_map_level(static_cast<std::size_t>(number));
    const Eigen::Isometry2d T_cm =
        Eigen::Translation2d(100.0 * T_own_beside.translation().head<2>()) *
        Eigen::Rotation2Dd(Yaw(T_own_beside));
    for (Post post : places.Of(number).posts) {
      const Eigen::Vector2d at_cm = T_cm * Eigen::Vector2d(post.x_cm, post.y_cm);
      post.x_cm = static_cast<std::int16_t>(std::lround(at_cm.x()));
      post.y_cm = static_cast<std::int16_t>(std::lround(at_cm.y()));
      merged.posts.push_back(post);
    }
  }
  return merged;
}

void AutoSearch::ScoreWithBeside(QueryMatch& match, PlaceStructures& places,
                                 const SearchControl& control, Looked& looked,
                                 std::vector<Spot>& spots) const {
  constexpr std::size_t kMostWeighed = 12;  // a large cohort; all within reach find no more
  constexpr double kReach = 0.1;            // what is behind by more is so from anywhere
  const EvidenceParams& params = match.params().evidence;
  const double cohort_share = CohortShare(spots, params, up_);
  if (params.num_beside == 0 || cohort_share == 0.0) return;
  const double least = spots.front().score - kReach;
  std::vector<double> gains;
  for (const Spot& spot : std::span(spots).first(std::min(kMostWeighed, spots.size()))) {
    if (spot.score < least) break;
    const double with_beside = ScoreOf(spot.hypothesis, looked.with_beside, [&] {
      const Structure merged = MergedBeside(places, spot, params.num_beside, control);
      const PlanarPose& pose = spot.hypothesis.T_place_query;
      match.SetPlace(merged);
      return WithInliers(match.Score(pose), match.InlierRatio(match.LinesOf(merged), pose), params);
    });
    gains.push_back(with_beside - spot.score);
  }
  const double usual_gain =
      std::accumulate(gains.begin(), gains.end(), 0.0) / static_cast<double>(gains.size());
  for (std::size_t i = 0; i < gains.size(); ++i) {
    spots[i].score += cohort_share * (gains[i] - usual_gain);
  }
  SortByScore(spots);
}

}  // namespace scanloc
