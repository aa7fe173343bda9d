#include "structural/auto_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/uncertainty.hpp"

namespace scanloc {
namespace {

Pose PlanarTransform(const PlanarPose& pose, double z_m) {
  Pose transform = Pose::Identity();
  transform.translate(Eigen::Vector3d(pose.x_m, pose.y_m, z_m));
  transform.rotate(Eigen::AngleAxisd(pose.yaw_rad, Eigen::Vector3d::UnitZ()));
  return transform;
}

/// Whether one looks the other way.
bool LooksBack(const Spot& a, const Spot& b, const Eigen::Vector3d& up) {
  return DifferenceOf(a.T_map_query, b.T_map_query, up).heading_deg > 90.0;
}

}  // namespace

class AutoSearch::Structures : public PlaceStructures {
 public:
  Structures(const AutoSearch& search, PayloadView& payload) : search_(search), payload_(payload) {}

  const Structure& Of(std::int32_t place) override {
    return payload_.StructureOf(static_cast<std::size_t>(place));
  }

  UprightPose Upright(std::int32_t place, const PlanarPose& T_place_query) override {
    const Pose T_map_level = search_.T_map_level(static_cast<std::size_t>(place));
    const Eigen::Vector3d position =
        T_map_level * Eigen::Vector3d(T_place_query.x_m, T_place_query.y_m, 0.0);
    const Eigen::Vector3d ahead =
        T_map_level.linear() *
        Eigen::Vector3d(std::cos(T_place_query.yaw_rad), std::sin(T_place_query.yaw_rad), 0.0);
    return {{position.dot(search_.east_), position.dot(search_.north_)},
            position.dot(search_.up_),
            std::atan2(ahead.dot(search_.north_), ahead.dot(search_.east_))};
  }

 private:
  const AutoSearch& search_;
  PayloadView& payload_;
};

AutoSearch::AutoSearch(const Map& map, const Eigen::Vector3d& up, const AutoSearch* before)
    : map_(map),
      places_(map.places),
      signatures_(map, before == nullptr ? nullptr : &before->signatures_) {
  Extend(up);
}

void AutoSearch::Extend(const Eigen::Vector3d& up) {
  const std::size_t num_known = num_known_;
  const bool is_anew = num_known == 0 || up != up_;
  if (is_anew) {
    up_ = up;
    east_ = up.unitOrthogonal();
    north_ = up.cross(east_);
    lowest_m_ = std::numeric_limits<double>::infinity();
    highest_m_ = -lowest_m_;
  }
  for (std::size_t i = is_anew ? 0 : num_known; i < map_.places.size(); ++i) {
    const double height_m = map_.places[i].T_map_place.translation().dot(up_);
    lowest_m_ = std::min(lowest_m_, height_m);
    highest_m_ = std::max(highest_m_, height_m);
  }
  levels_m_ = Levels();
  num_known_ = map_.places.size();
  places_.Extend();
  signatures_.Extend();
}

Pose AutoSearch::T_map_level(std::size_t place) const {
  return map_.places[place].T_map_place * LevelFromSensor(map_.grounds[place].ground).inverse();
}

absl::StatusOr<std::vector<Spot>> AutoSearch::Find(const ScanDescriptor& query,
                                                   const Options& options,
                                                   const SearchControl& control,
                                                   StageTimes& times) const {
  PayloadView payload(map_, control);
  const Structure& structure = query.structure;
  const std::array<std::vector<Hypothesis>, 2> proposed =
      Propose(query, options.shortlist, payload, control, times);
  if (!payload.status().ok()) return payload.status();
  const std::int64_t start_ns = control.Now_ns();

  const AutoParams& params = map_.params.automatic;
  const auto grids = spare_grids_.Borrow([&] { return std::make_unique<MatchGrids>(params); });
  QueryMatch match(structure, params, map_.params.sensor_height_m, *grids);
  // Where a robot should be is looked at first, should time run out.
  Structures structures(*this, payload);
  std::vector<Hypothesis> verified =
      VerifyPredicted(match, structure, structures, options, control);
  const auto add = [&](const std::vector<Hypothesis>& more) {
    verified.insert(verified.end(), more.begin(), more.end());
  };
  for (const std::vector<Hypothesis>& part : proposed) {
    add(Verify(match, part, structures, control, params.verify.selection));
  }
  if (!payload.status().ok()) return payload.status();
  if (verified.empty()) return std::vector<Spot>();
  // Whatever the time: without its rivals the best would look surer than it is. With inliers
  // another may be the best; so that it ends, that is asked a few times only.
  constexpr int kMaxLooks = 3;
  Hypothesis best = *std::ranges::max_element(verified, {}, &Hypothesis::score);
  std::vector<Spot> spots;
  Looked looked;
  for (int look = 0; look < kMaxLooks; ++look) {
    add(VerifyRivals(match, structure, payload, best, control));
    spots = Distinct(structure, verified);
    ScoreWithInliers(match, structures, looked, spots);
    ScoreWithBeside(match, structures, control, looked, spots);
    const Pose T_map_best = PoseInMap(structure, best);
    if (!MissOf(DifferenceOf(T_map_best, spots.front().T_map_query, up_)).any()) break;
    best = spots.front().hypothesis;
  }
  const int num_seen = std::max(options.num_supported, options.num_measured);
  for (std::size_t i = 0; i < spots.size() && static_cast<int>(i) < num_seen; ++i) {
    const Hypothesis& hypothesis = spots[i].hypothesis;
    const Structure& place = structures.Of(hypothesis.place);
    match.SetPlace(place);
    spots[i].covariance =
        Rotated(T_map_level(static_cast<std::size_t>(hypothesis.place)).linear(),
                CovarianceInLevel(match, structure, place, hypothesis.T_place_query,
                                  UnevennessAround(hypothesis.place, control)));
    if (static_cast<int>(i) >= options.num_supported) continue;
    spots[i].support = SupportOf(match, structure, place, hypothesis.T_place_query);
  }
  times.verify_ns = control.Now_ns() - start_ns;
  if (!payload.status().ok()) return payload.status();
  return spots;
}

Unevenness AutoSearch::UnevennessAround(std::int32_t place, const SearchControl& control) const {
  const auto here = static_cast<std::size_t>(place);
  const Pose T_map_here = T_map_level(here);
  Unevenness unevenness(map_.params.automatic.ground);
  // However densely places stand: some at half of the reach, and some near its end.
  std::vector<std::size_t> around;
  for (const double share : {0.4, 0.8}) {
    const double far_m = share * unevenness.reach_m();
    for (const auto& [x, y] :
         {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      const auto nearest = places_.Nearest(T_map_here * Eigen::Vector3d(x * far_m, y * far_m, 0.0),
                                           control.excluded);
      if (nearest && *nearest != here) around.push_back(*nearest);
    }
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  for (const std::size_t other : around) {
    unevenness.Add(T_map_here.inverse() * T_map_level(other),
                   static_cast<double>(map_.grounds[other].ground.height_m) -
                       static_cast<double>(map_.grounds[here].ground.height_m));
  }
  return unevenness;
}

std::vector<Spot> AutoSearch::Distinct(const Structure& query,
                                       std::vector<Hypothesis> verified) const {
  std::ranges::stable_sort(verified, std::greater(), &Hypothesis::score);
  std::vector<Spot> spots;
  for (const Hypothesis& hypothesis : verified) {
    const Pose T_map_query = PoseInMap(query, hypothesis);
    const bool is_known = std::any_of(spots.begin(), spots.end(), [&](const Spot& spot) {
      return !MissOf(DifferenceOf(spot.T_map_query, T_map_query, up_)).any();
    });
    if (!is_known) spots.push_back({hypothesis, hypothesis.score, T_map_query});
  }
  return spots;
}

std::optional<Hypothesis> AutoSearch::HypothesisAt(const Structure& query, const Pose& T_map_query,
                                                   const SearchControl& control) const {
  const auto place = places_.Nearest(T_map_query.translation(), control.excluded);
  if (!place) return std::nullopt;
  return HypothesisOn(query, T_map_query, *place);
}

Hypothesis AutoSearch::HypothesisOn(const Structure& query, const Pose& T_map_query,
                                    std::size_t place) const {
  const Pose T_place_query =
      T_map_level(place).inverse() * T_map_query * LevelFromSensor(query).inverse();
  return {static_cast<std::int32_t>(place),
          {T_place_query.translation().x(), T_place_query.translation().y(), Yaw(T_place_query)}};
}

std::vector<Hypothesis> AutoSearch::VerifyPredicted(QueryMatch& match, const Structure& query,
                                                    PlaceStructures& places, const Options& options,
                                                    const SearchControl& control) const {
  std::vector<Hypothesis> predicted;
  for (const Pose& T_map_query : options.predicted) {
    auto at = HypothesisAt(query, T_map_query, control);
    if (!at) continue;
    at->is_usual = false;
    predicted.push_back(*at);
  }
  if (options.are_predicted_near) {
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      if (i > 0 && control.IsOver()) {
        predicted.resize(i);
        break;
      }
      match.LayFinely(places.Of(predicted[i].place), predicted[i]);
    }
    return predicted;
  }
  SelectionParams all = map_.params.automatic.verify.selection;
  all.num_hypotheses = all.max_per_spot = static_cast<int>(predicted.size());
  return Verify(match, std::move(predicted), places, control, all);
}

Pose AutoSearch::PoseInMap(const Structure& query, const Hypothesis& hypothesis) const {
  const auto place = static_cast<std::size_t>(hypothesis.place);
  const double z_m = static_cast<double>(query.height_m) - map_.grounds[place].ground.height_m;
  return T_map_level(place) * PlanarTransform(hypothesis.T_place_query, z_m) *
         LevelFromSensor(query);
}

std::optional<Candidate> AutoSearch::CandidateAt(const Pose& T_map_query,
                                                 const std::optional<PoseCovariance>& covariance,
                                                 double score, double confidence,
                                                 const SearchControl& control) const {
  const auto place = places_.Nearest(T_map_query.translation(), control.excluded);
  if (!place) return std::nullopt;
  Candidate candidate = CandidateOf(map_, *place);
  const Pose T_place_query = candidate.T_map_place.inverse() * T_map_query;
  candidate.distance = 1.0 - score;
  candidate.confidence = confidence;
  candidate.yaw_rad = Yaw(T_place_query);
  candidate.lateral_m = T_place_query.translation().y();
  candidate.T_map_query = T_map_query;
  candidate.covariance = covariance;
  return candidate;
}

void SortByScore(std::vector<Spot>& spots) {
  std::ranges::stable_sort(spots, std::greater(), &Spot::score);
}

bool IsAbove(const Spot& a, const Spot& b, const Eigen::Vector3d& up) {
  const PoseMiss miss = MissOf(DifferenceOf(a.T_map_query, b.T_map_query, up));
  return miss.height && !miss.plane && !miss.heading;
}

double CohortShare(const std::vector<Spot>& spots, const EvidenceParams& params,
                   const Eigen::Vector3d& up) {
  std::vector<double> scores;
  for (const Spot& spot : spots) {
    const bool is_best = &spot == &spots.front();
    if (is_best || (spot.hypothesis.is_usual && !IsAbove(spots.front(), spot, up))) {
      scores.push_back(spot.score);
    }
  }
  return CohortShare(scores, params);
}

std::vector<double> ConfidencesOf(const std::vector<Spot>& spots, const EvidenceParams& params,
                                  const Eigen::Vector3d& up) {
  if (spots.empty()) return {};
  const Spot& best = spots.front();
  const std::size_t num_posts = best.support->num_posts;
  EvidenceParams of_twice_as_many = params;
  of_twice_as_many.cohort_size *= 2;
  const double large_cohort_share = CohortShare(spots, of_twice_as_many, up);
  // Halls turned about are two; where many look the other way, they are aisles like any others.
  std::vector<double> turned = {best.score};
  for (const Spot& spot : spots) {
    if (spot.hypothesis.is_usual && LooksBack(best, spot, up)) turned.push_back(spot.score);
  }
  const double withheld = large_cohort_share * (1.0 - CohortShare(turned, params));
  std::vector<double> scores;
  std::vector<double> cautious;
  bool has_floors = false;
  for (const Spot& spot : spots) {
    const bool is_above = IsAbove(best, spot, up);
    has_floors = has_floors || is_above;
    const auto raised = [&](double more) {
      return std::max(spot.score, std::min(spot.score + more, best.score));
    };
    double more = 0.0;
    if (LooksBack(best, spot, up)) {
      more = MoreOfTurned(spot.score, spot.hypothesis.score, num_posts, withheld, params);
    }
    if (is_above) more = params.equal_floors;
    // Of floors a small lead says little even so.
    scores.push_back(is_above ? raised(0.5 * more) : spot.score);
    cautious.push_back(raised(more));
  }
  std::vector<double> confidences = Confidences(
      scores, *best.support, CohortShare(spots, params, up), params, large_cohort_share, cautious);
  // Of alike floors the other may fit best a few steps on.
  const bool is_other_floor_near =
      has_floors && std::any_of(spots.begin(), spots.end(), [&](const Spot& spot) {
        return spot.score + params.equal_floors > best.score &&
               MissOf(DifferenceOf(best.T_map_query, spot.T_map_query, up)).height;
      });
  const bool is_doubtful = best.support->unseen > params.max_unseen ||
                           ExplainsLittle(best.hypothesis.score, *best.support, params);
  if (is_other_floor_near || (is_doubtful && confidences.front() < params.sure_of_little)) {
    confidences.front() = std::min(confidences.front(), params.undecided);
  }
  return confidences;
}

std::size_t CountDistinct(std::span<const Post> posts, double cell_m) {
  const double cell_cm = 100.0 * cell_m;
  std::vector<std::pair<int, int>> cells;
  cells.reserve(posts.size());
  for (const Post& post : posts) {
    cells.emplace_back(static_cast<int>(std::floor(post.x_cm / cell_cm)),
                       static_cast<int>(std::floor(post.y_cm / cell_cm)));
  }
  std::sort(cells.begin(), cells.end());
  return static_cast<std::size_t>(std::unique(cells.begin(), cells.end()) - cells.begin());
}

bool ShowsEnough(std::span<const Post> posts, const AutoParams& params) {
  const double cell_m = params.posts.cell_m;
  const auto least = static_cast<std::size_t>(params.evidence.min_posts);
  // Mostly some of them do.
  const std::span<const Post> some = posts.first(std::min(posts.size(), 2 * least));
  return CountDistinct(some, cell_m) >= least || CountDistinct(posts, cell_m) >= least;
}

}  // namespace scanloc
