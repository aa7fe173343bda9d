#include "track/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "scanloc/core/scan/pose_difference.hpp"

namespace scanloc {

/// How far from where it was reckoned a track may be found.
struct Tracks::Gate {
  double plane_m = 0.0;
  double per_metre = 0.0;  // and more by what it went unseen
  double heading_rad = 0.0;
  double height_m = 0.0;
  double height_per_metre = 0.0;  // and more by what it is off in the plane

  /// The best spot where a track may have got to.
  [[nodiscard]] const Sighting* Find(const Look& look, const ReckonedPose& pose) const {
    const auto found = std::find_if(look.spots.begin(), look.spots.end(), [&](const auto& spot) {
      const PoseDifference off = DifferenceOf(spot.T_map_scan, pose.T_map_scan(), look.up);
      return off.plane_m <= plane_m + per_metre * pose.unseen_m() &&
             off.height_m <= height_m + height_per_metre * off.plane_m &&
             off.heading_deg * std::numbers::pi / 180.0 <= heading_rad;
    });
    return found == look.spots.end() ? nullptr : &*found;
  }
};

/// A scan, and what it means in the light of what was known before.
struct Tracks::Weighing {
  const Look& look;
  bool is_held = false;  // one track is sure, and what speaks against it is its scans' fault first
  double most_told = 0.0;  // that a scan which stands alone may say, where none was sure before
};

Tracks::Gate Tracks::GateOf(const Look& look) const {
  Gate gate{.height_m = params_.height_gate_m, .height_per_metre = params_.height_gate_per_metre};
  if (look.T_last_scan) {
    gate.plane_m = params_.gate_m;
    gate.per_metre = params_.gate_per_metre;
    gate.heading_rad = params_.gate_rad;
  } else {
    gate.plane_m = look.max_step_m;
    gate.heading_rad = params_.free_gate_rad;
  }
  return gate;
}

void Tracks::Move(const std::optional<Pose>& T_last_scan) {
  if (!T_last_scan) return;
  if (ReckonsHeight(*T_last_scan)) reckons_height_ = true;
  told_ago_m_ += T_last_scan->translation().norm();
  for (Track& track : tracks_) track.pose.Move(*T_last_scan);
}

void Tracks::LoseLead() {
  const double all = tracks_.empty() ? 0.0 : std::min(tracks_.front().standing(), 0.0);
  for (Track& track : tracks_) {
    track.log_odds = all;
    track.told = track.earned = track.doubt = 0.0;
  }
  is_sure_ = false;
}

void Tracks::Forget(double way_m) {
  constexpr double kTold_m = 10.0;  // to 1/e
  const double kept = std::exp(-way_m / kTold_m);
  for (Track& track : tracks_) {
    track.log_odds += (1.0 - kept) * track.told;
    track.told *= kept;
    track.earned *= kept;
  }
}

void Tracks::PassBlindly(const std::optional<Pose>& T_last_scan) {
  Move(T_last_scan);
  const double way_m = T_last_scan ? T_last_scan->translation().norm() : 0.0;
  // Who stands may be in a lift, and so may who does not reckon its height; who does not know how
  // it moves may have been carried. Who knows loses its lead by and by.
  if (way_m < params_.standing_m || !reckons_height_) {
    LoseLead();
  } else {
    for (Track& track : tracks_) track.log_odds *= std::exp(-way_m / params_.fade_m);
  }
  for (Track& track : tracks_) {
    track.rivalry = params_.max_scan_log_odds;
    track.unrivalled = 0.0;
    track.covariance.reset();
  }
}

bool Tracks::IsSure() const {
  if (tracks_.empty()) return false;
  const double second = tracks_.size() < 2 ? -params_.max_log_odds : tracks_[1].standing();
  // Doubts do not count until another is ahead. Once it is sure, it need not be surer than that the
  // robot is nowhere in the map.
  const double lead = tracks_.front().log_odds - (is_sure_ ? second : std::max(0.0, second));
  return lead > params_.sure_log_odds + (is_sure_ ? 0.0 : params_.told_log_odds);
}

bool Tracks::Take(const Weighing& weighing, const Sighting* spot, Track& track) const {
  const Look& look = weighing.look;
  const double behind = spot == nullptr ? 2.0 * params_.max_scan_log_odds : spot->behind;
  const double spoken =
      std::clamp(look.genuine - behind, -params_.max_scan_log_odds, params_.max_scan_log_odds);
  const bool is_found = spot != nullptr && spoken >= params_.lost_log_odds;
  track.covariance.reset();
  track.rivalry = 0.0;
  if (weighing.is_held) {
    // That its spot was not seen, or as another's, says little: it vanishes when it is seen again.
    track.log_odds += look.genuine;
    const double against = look.genuine - spoken;
    const double most = look.stands_alone ? params_.doubt_alone : params_.doubt;
    track.doubt =
        is_found && against < params_.equal_log_odds ? 0.0 : track.doubt + std::min(most, against);
    track.rivalry = is_found ? std::max(0.0, against) : params_.max_scan_log_odds;
  } else {
    track.doubt = 0.0;
    track.log_odds += spoken;
    if (!is_found) track.log_odds = std::min(track.log_odds, 0.0);
  }
  if (spot == nullptr || (weighing.is_held && !is_found)) return false;
  const double told = std::min(
      {spot->rivalry, weighing.most_told, std::max(0.0, params_.max_scan_log_odds - track.told)});
  track.log_odds -= told;
  track.told += told;
  track.rivalry += std::max(0.0, spot->rivalry - track.told);
  if (spot == &look.spots.front()) {
    track.earned = std::min(track.earned + weighing.most_told, params_.max_scan_log_odds);
  }
  if (look.T_last_scan) {
    constexpr double kLeastScore = 0.05;
    const double worse = std::pow(look.spots.front().score / std::max(kLeastScore, spot->score), 2);
    track.pose.Correct(spot->T_map_scan, std::max(1.0, worse), reckons_height_, look.up);
    if (track.pose.IsFarFrom(spot->T_map_scan, look.up)) track.rivalry += params_.far_log_odds;
  } else {
    track.pose = ReckonedPose(spot->T_map_scan);
  }
  track.covariance = spot->covariance;
  track.score = spot->score;
  track.unrivalled = spot->unrivalled;
  ++track.num_scans;
  return true;
}

void Tracks::Weigh(const Look& look) {
  if (look.genuine < params_.lost_log_odds && !tracks_.empty()) {
    PassBlindly(look.T_last_scan);
    return;
  }
  Move(look.T_last_scan);
  const bool is_first = tracks_.empty();
  const Gate gate = GateOf(look);
  const double begun = tracks_.empty() ? 0.0 : tracks_.front().log_odds;
  const bool was_sure = is_sure_ = IsSure();
  if (!was_sure && look.T_last_scan) Forget(look.T_last_scan->translation().norm());
  const auto is_lost = [&](const Sighting* spot) {
    return spot == nullptr || look.genuine - spot->behind < params_.lost_log_odds;
  };
  const bool is_best_lost = is_first || is_lost(gate.Find(look, tracks_.front().pose));
  // Only who stands, or does not know how it moves, can have been carried off.
  const bool may_be_carried =
      !look.T_last_scan || look.T_last_scan->translation().norm() < params_.standing_m;
  Weighing weighing{look};
  weighing.is_held = was_sure && look.T_last_scan && !(is_best_lost && may_be_carried);
  // Scans that are taken near each other err alike: several, some way apart, have to say it.
  if (look.stands_alone && !was_sure && (is_first || told_ago_m_ >= params_.told_every_m)) {
    weighing.most_told = params_.told_log_odds;
    told_ago_m_ = 0.0;
  }
  if (is_best_lost && !weighing.is_held) {
    LoseLead();
    if (!tracks_.empty()) tracks_.front().log_odds = begun;
  }

  std::vector<bool> is_taken(look.spots.size());
  std::vector<Track> weighed;
  for (Track track : tracks_) {
    const Sighting* spot = gate.Find(look, track.pose);
    if (Take(weighing, spot, track)) {
      // Tracks that met go on as the likelier one, which came first.
      const auto index = static_cast<std::size_t>(spot - look.spots.data());
      if (is_taken[index]) continue;
      is_taken[index] = true;
    }
    weighed.push_back(std::move(track));
  }
  // A spot that was not seen before may as well have been missed: what it has against it is what
  // the best is ahead of all others. While that one is sure, robots are seldom carried off.
  double prior = std::max(0.0, begun) - (is_first ? 0.0 : tracks_.front().earned);
  if (weighing.is_held) {
    prior = begun - params_.carried_penalty;
  } else if (is_best_lost) {
    prior = was_sure ? -params_.new_track_penalty : 0.0;
  }
  for (std::size_t i = 0; i < look.spots.size(); ++i) {
    if (is_taken[i]) continue;
    const ReckonedPose pose(look.spots[i].T_map_scan);
    Track& track = weighed.emplace_back(Track{.pose = pose, .log_odds = prior, .id = next_id_++});
    Take({look, false, weighing.most_told}, &look.spots[i], track);
    track.pose = pose;
  }
  Tidy(std::move(weighed));
  if (tracks_.empty()) return;
  if (is_first) {
    usual_ground_m_ = look.ground_m;
  } else if (MayChangeFloors(look)) {
    LoseLead();
  } else {
    return;
  }
  lead_height_m_ = tracks_.front().pose.T_map_scan().translation().dot(look.up);
}

bool Tracks::MayChangeFloors(const Look& look) {
  constexpr double kShareOfLast = 0.1;    // in the means
  constexpr double kShortStep = 0.25;     // of a usual one: it has stopped on the way
  constexpr double kOtherGround_m = 0.2;  // than usual: stairs
  if (reckons_height_ || !look.T_last_scan) return false;
  const double step_m = look.T_last_scan->translation().norm();
  const Track& best = tracks_.front();
  const double climbed_m = best.pose.T_map_scan().translation().dot(look.up) - lead_height_m_;
  const bool may = step_m < std::max(params_.standing_m, kShortStep * usual_step_m_) ||
                   std::abs(look.ground_m - usual_ground_m_) > kOtherGround_m || best.doubt > 0.0 ||
                   std::abs(climbed_m) > params_.climb_m;
  usual_step_m_ += kShareOfLast * (step_m - usual_step_m_);
  usual_ground_m_ += kShareOfLast * (look.ground_m - usual_ground_m_);
  return may;
}

void Tracks::Tidy(std::vector<Track> tracks) {
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.standing() > b.standing(); });
  // None is surer than max_log_odds; what each has over the others stays.
  double excess = 0.0;
  for (const Track& track : tracks) {
    excess = std::max(excess, track.log_odds - params_.max_log_odds);
  }
  for (Track& track : tracks) track.log_odds -= excess;
  while (tracks.size() > 1 &&
         (tracks.size() > kMaxTracks || tracks.back().standing() < params_.least_log_odds)) {
    tracks.pop_back();
  }
  tracks_ = std::move(tracks);
}

}  // namespace scanloc
