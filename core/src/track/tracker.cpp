#include "scanloc/core/track/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "map/narrowing.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"

namespace scanloc {

/// A scan: where it may have been taken, and how far from their predicted poses tracks may be
/// found.
struct Tracker::Step {
  struct Candidate {
    Pose T_map_scan;
    std::optional<PoseCovariance> covariance;
    double score = 0.0;
    double unrivalled = 0.0;  // as in Track
    double log_odds = 0.0;    // of this scan, as far as scans in a row may add it up
    double rivalry = 0.0;     // what this scan alone says against it beyond that
  };
  std::vector<Candidate> spots;  // distinct, best first
  Eigen::Vector3d up;
  TrackParams params;
  double gate_m = 0.0;
  double gate_rad = 0.0;
  StageTimes times;

  /// The best spot where a track may have got to.
  [[nodiscard]] const Candidate* Find(const Pose& T_map_predicted) const {
    const auto found = std::find_if(spots.begin(), spots.end(), [&](const Candidate& spot) {
      const PoseDifference off = DifferenceOf(spot.T_map_scan, T_map_predicted, up);
      return off.plane_m <= gate_m &&
             off.height_m <= params.height_gate_m + params.height_gate_per_metre * off.plane_m &&
             off.heading_deg * std::numbers::pi / 180.0 <= gate_rad;
    });
    return found == spots.end() ? nullptr : &*found;
  }
};

Tracker::Tracker(std::shared_ptr<const Localizer> localizer, const TrackerOptions& options)
    : localizer_(std::move(localizer)), options_(options) {}

absl::StatusOr<Tracker> Tracker::Create(std::shared_ptr<const Localizer> localizer,
                                        const TrackerOptions& options) {
  if (options.query.method && !options.query.method->automatic) {
    return absl::InvalidArgumentError(
        absl::StrFormat("a moving robot is tracked with the method auto, not %s",
                        MethodName(*options.query.method)));
  }
  TrackerOptions checked = options;
  checked.query.method = Method{.automatic = true};
  if (absl::Status status = Validate(checked.query, localizer->map().params); !status.ok()) {
    return status;
  }
  if (!(options.max_step_m > 0.0 && options.max_step_m <= 1000.0)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("max_step_m is %g; it must be in (0, 1000]", options.max_step_m));
  }
  return Tracker(std::move(localizer), checked);
}

void Tracker::Reset() {
  tracks_.clear();
  last_localized_ = 0;
}

void Tracker::Move(const std::optional<Pose>& T_last_scan) {
  if (!T_last_scan) return;
  for (Track& track : tracks_) track.T_map_scan = track.T_map_scan * *T_last_scan;
}

void Tracker::LoseSight() {
  // The robot may have been carried, or taken a lift: what a track had over others is gone.
  for (Track& track : tracks_) track.log_odds = std::min(track.log_odds, 0.0);
}

void Tracker::Weigh(const Step& step) {
  const TrackParams& params = step.params;
  const double begun = tracks_.empty() ? 0.0 : tracks_.front().log_odds;
  const double second = tracks_.size() < 2 ? 0.0 : std::max(0.0, tracks_[1].total());
  const bool is_sure = !tracks_.empty() && tracks_.front().total() - second > params.sure_log_odds;
  std::vector<bool> is_taken(step.spots.size());
  std::vector<Track> weighed;
  bool is_best = true;
  bool is_best_lost = true;
  for (Track track : tracks_) {
    const Step::Candidate* spot = step.Find(track.T_map_scan);
    const bool is_lost = spot == nullptr || spot->log_odds < params.lost_log_odds;
    track.log_odds += spot == nullptr ? -params.max_scan_log_odds : spot->log_odds;
    track.rivalry = 0.0;
    track.covariance.reset();
    if (is_best) is_best_lost = is_lost;
    if (is_lost && is_best) LoseSight();
    if (is_lost) track.log_odds = std::min(track.log_odds, 0.0);
    is_best = false;
    if (spot != nullptr) {
      const auto index = static_cast<std::size_t>(spot - step.spots.data());
      // Tracks that met go on as the likelier one, which came first.
      if (is_taken[index]) continue;
      is_taken[index] = true;
      track.T_map_scan = spot->T_map_scan;
      track.covariance = spot->covariance;
      track.score = spot->score;
      track.unrivalled = spot->unrivalled;
      track.rivalry = spot->rivalry;
      ++track.num_scans;
    }
    weighed.push_back(track);
  }
  // A spot that was not seen before may as well have been missed: what it has against it is only
  // what the best is ahead of all others.
  const double prior =
      std::max(0.0, is_best_lost ? 0.0 : begun) - (is_sure ? params.new_track_penalty : 0.0);
  for (std::size_t i = 0; i < step.spots.size(); ++i) {
    if (is_taken[i]) continue;
    const Step::Candidate& spot = step.spots[i];
    const double log_odds = prior + spot.log_odds;
    weighed.push_back({spot.T_map_scan, spot.covariance, spot.score, spot.unrivalled, log_odds,
                       spot.rivalry, 1, next_id_++});
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Track& a, const Track& b) { return a.total() > b.total(); });
  // None is surer than max_log_odds; what each has over the others stays.
  double excess = 0.0;
  for (const Track& track : weighed) {
    excess = std::max(excess, track.log_odds - params.max_log_odds);
  }
  for (Track& track : weighed) track.log_odds -= excess;
  while (weighed.size() > 1 &&
         (weighed.size() > kMaxTracks || weighed.back().log_odds < params.least_log_odds)) {
    weighed.pop_back();
  }
  tracks_ = std::move(weighed);
}

TrackedAnswer Tracker::Tell(const Step& step, const SearchControl& control) {
  const Map& map = localizer_->map();
  TrackedAnswer told;
  Answer& answer = told.answer;
  answer.content_id = map.content_id;
  answer.times = step.times;
  // Against each other and against being nowhere in the map; with what the last scan alone says and
  // without, whichever is less sure.
  double sum = 1.0;
  double sum_in_a_row = 1.0;
  for (const Track& track : tracks_) {
    sum += std::exp(track.total());
    sum_in_a_row += std::exp(track.log_odds);
  }
  const auto confidence_of = [&](const Track& track) {
    return std::min(std::exp(track.total()) / sum, std::exp(track.log_odds) / sum_in_a_row);
  };
  for (const Track& track : tracks_) {
    if (static_cast<int>(answer.candidates.size()) >= options_.query.max_answers) break;
    auto candidate = localizer_->auto_search_->CandidateAt(
        track.T_map_scan, track.covariance, track.score, confidence_of(track), control);
    if (candidate) answer.candidates.push_back(*std::move(candidate));
  }
  if (answer.candidates.empty()) {
    answer.reason = "the map has no place to compare with";
    return told;
  }
  const Track& best = tracks_.front();
  told.num_scans = best.num_scans;
  const double least = options_.query.min_confidence.value_or(map.params.search.min_confidence);
  const double confidence = confidence_of(best);
  if (confidence >= least) {
    answer.outcome = Outcome::kLocalized;
    told.is_relocated = last_localized_ != 0 && last_localized_ != best.id;
    last_localized_ = best.id;
    answer.reason = absl::StrFormat("%d scans agree on the spot%s", best.num_scans,
                                    told.is_relocated ? ", which is not where the robot was" : "");
  } else if (best.unrivalled >= least && tracks_.size() > 1) {
    answer.outcome = Outcome::kAmbiguous;
    answer.reason = absl::StrFormat(
        "distinct spots explain the last scans: the best has a probability of %.2f, the next %.2f",
        confidence, confidence_of(tracks_[1]));
  } else {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = absl::StrFormat(
        "the scans speak for no spot: the best has a probability of %.2f", confidence);
  }
  return told;
}

absl::StatusOr<Tracker::Step> Tracker::Look(const ScanDescriptor& scan,
                                            const std::optional<Pose>& T_last_scan,
                                            const SearchControl& control) const {
  const EvidenceParams& evidence = localizer_->map().params.automatic.evidence;
  const TrackParams& params = localizer_->map().params.automatic.track;
  AutoSearch::Options search{.shortlist = options_.query.num_candidates.value_or(0),
                             .num_supported = params.num_supported,
                             .num_measured = params.num_supported};
  for (const Track& track : tracks_) {
    search.predicted.push_back(T_last_scan ? track.T_map_scan * *T_last_scan : track.T_map_scan);
  }
  Step step;
  step.params = params;
  const double travelled_m = T_last_scan ? T_last_scan->translation().norm() : 0.0;
  step.gate_m =
      T_last_scan ? params.gate_m + params.gate_per_metre * travelled_m : options_.max_step_m;
  step.gate_rad = T_last_scan ? params.gate_rad : params.free_gate_rad;
  const AutoSearch& auto_search = *localizer_->auto_search_;
  step.up = auto_search.up();
  const absl::StatusOr<std::vector<Spot>> spots =
      auto_search.Find(scan, search, control, step.times);
  if (control.IsUnwanted()) return absl::CancelledError("nobody waits for the answer any more");
  if (!spots.ok()) return spots.status();
  const std::vector<Spot>& found = *spots;
  for (const Spot& spot : found) {
    const Support& support = spot.support ? *spot.support : *found.front().support;
    const double best_score = found.front().hypothesis.score;
    const double score = spot.hypothesis.score;
    const double genuine = GenuineLogOdds(support, evidence);
    const double in_a_row = RivalryLogOddsInARow(best_score, score, support.num_posts, evidence);
    step.spots.push_back(
        {spot.T_map_query, spot.covariance, score, Logistic(SupportLogOdds(support, evidence)),
         std::clamp(genuine - in_a_row, -params.max_scan_log_odds, params.max_scan_log_odds),
         RivalryLogOdds(best_score, score, support.num_posts, evidence) - in_a_row});
  }
  return step;
}

absl::StatusOr<TrackedAnswer> Tracker::Update(const ScanDescriptor& scan,
                                              const std::optional<Pose>& T_last_scan,
                                              const SearchControl& control) {
  if (absl::Status status = localizer_->Check(scan, options_.query, control); !status.ok()) {
    return status;
  }
  std::optional<Pose> T_last;
  if (T_last_scan) {
    absl::StatusOr<Pose> pose = PoseFromMatrix(T_last_scan->matrix().topRows<3>());
    if (!pose.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat("the pose since the last scan: ", pose.status().message()));
    }
    T_last = *pose;
  }
  SearchControl within = control;
  absl::StatusOr<Narrowing> narrowing = Narrowing();
  if (!options_.query.prior.is_open()) {
    narrowing = Narrow(localizer_->map(), options_.query.prior, control.excluded);
    if (!narrowing.ok()) return narrowing.status();
    within.excluded = &narrowing->excluded;
  }
  const Params& params = localizer_->map().params;
  if (scan.num_voxels < static_cast<std::uint32_t>(params.search.min_voxels) ||
      !ShowsEnough(scan.structure.posts, params.automatic)) {
    absl::StatusOr<Answer> answer = localizer_->Localize(scan, options_.query, control);
    if (!answer.ok()) return answer.status();
    Move(T_last);
    LoseSight();
    return TrackedAnswer{.answer = *std::move(answer)};
  }
  const absl::StatusOr<Step> step = Look(scan, T_last, within);
  if (!step.ok()) return step.status();
  Move(T_last);
  Weigh(*step);
  return Tell(*step, within);
}

}  // namespace scanloc
