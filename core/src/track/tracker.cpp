#include "scanloc/core/track/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "structural/auto_search.hpp"

namespace scanloc {
namespace {

/// One scan says at most so much for or against a track: scans that follow each other are alike,
/// and so are their errors.
constexpr double kMaxScanLogOdds = 6.0;
constexpr double kMaxLogOdds = 8.0;
/// What is left of older evidence after each scan.
constexpr double kMemory = 0.75;
/// Robots are seldom carried off: what a track that begins has against it while another is sure.
constexpr double kNewTrackPenalty = 4.0;
constexpr double kSureLogOdds = 3.0;
/// Tracks less likely than this are given up.
constexpr double kLeastLogOdds = -5.0;

/// By odometry: how far from where it should be a track may be found, and how far turned.
constexpr double kGate_m = 3.0;
constexpr double kGatePerMetre = 0.1;
constexpr double kGate_rad = 0.35;
/// Without: turned by less than half a turn between two scans.
constexpr double kFreeGate_rad = 0.75 * std::numbers::pi;

double PlanarDistance(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).head<2>().norm();
}

}  // namespace

/// A scan: where it may have been taken, and how far from their predicted poses tracks may be
/// found.
struct Tracker::Step {
  struct Spot {
    Pose T_map_scan;
    double score = 0.0;
    double unrivalled = 0.0;  // as in Track
    double log_odds = 0.0;    // of this scan alone
  };
  std::vector<Spot> spots;  // distinct, best first
  double best_score = 0.0;
  double gate_m = 0.0;
  double gate_rad = 0.0;
  StageTimes times;

  /// The best spot where a track may have got to.
  [[nodiscard]] const Spot* Find(const Pose& T_map_predicted) const {
    const auto found = std::find_if(spots.begin(), spots.end(), [&](const Spot& spot) {
      return PlanarDistance(spot.T_map_scan, T_map_predicted) <= gate_m &&
             std::abs(Yaw(T_map_predicted.inverse() * spot.T_map_scan)) <= gate_rad;
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

void Tracker::Weigh(const Step& step) {
  const Calibration& calibration = localizer_->map().calibration;
  const bool is_sure = !tracks_.empty() && tracks_.front().log_odds > kSureLogOdds;
  const double lost = std::clamp(
      LogOdds(calibration, {std::min(kUnrelatedScore, step.best_score), step.best_score}),
      -kMaxScanLogOdds, 0.0);
  std::vector<bool> is_taken(step.spots.size());
  std::vector<Track> weighed;
  for (Track track : tracks_) {
    const Step::Spot* spot = step.Find(track.T_map_scan);
    track.log_odds =
        std::clamp(kMemory * track.log_odds + (spot == nullptr ? lost : spot->log_odds),
                   -kMaxLogOdds, kMaxLogOdds);
    if (spot != nullptr) {
      const auto index = static_cast<std::size_t>(spot - step.spots.data());
      // Tracks that met go on as the likelier one, which came first.
      if (is_taken[index]) continue;
      is_taken[index] = true;
      track.T_map_scan = spot->T_map_scan;
      track.score = spot->score;
      track.unrivalled = spot->unrivalled;
      ++track.num_scans;
    }
    weighed.push_back(track);
  }
  for (std::size_t i = 0; i < step.spots.size(); ++i) {
    if (is_taken[i]) continue;
    const Step::Spot& spot = step.spots[i];
    weighed.push_back({spot.T_map_scan, spot.score, spot.unrivalled,
                       spot.log_odds - (is_sure ? kNewTrackPenalty : 0.0), 1, next_id_++});
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Track& a, const Track& b) { return a.log_odds > b.log_odds; });
  while (weighed.size() > 1 &&
         (weighed.size() > kMaxTracks || weighed.back().log_odds < kLeastLogOdds)) {
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
  // Against each other and against being nowhere in the map.
  double sum = 1.0;
  for (const Track& track : tracks_) sum += std::exp(track.log_odds);
  for (const Track& track : tracks_) {
    if (static_cast<int>(answer.candidates.size()) >= options_.query.max_answers) break;
    auto candidate = localizer_->auto_search_->CandidateAt(track.T_map_scan, track.score,
                                                           std::exp(track.log_odds) / sum, control);
    if (candidate) answer.candidates.push_back(*std::move(candidate));
  }
  if (answer.candidates.empty()) {
    answer.reason = "the map has no place to compare with";
    return told;
  }
  const Track& best = tracks_.front();
  told.num_scans = best.num_scans;
  const double least = options_.query.min_confidence.value_or(map.params.search.min_confidence);
  const double confidence = std::exp(best.log_odds) / sum;
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
        confidence, std::exp(tracks_[1].log_odds) / sum);
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
  AutoSearch::Options search{.shortlist =
                                 options_.query.num_candidates.value_or(AutoSearch::kShortlist)};
  for (const Track& track : tracks_) {
    search.predicted.push_back(T_last_scan ? track.T_map_scan * *T_last_scan : track.T_map_scan);
  }
  Step step;
  const double travelled_m = T_last_scan ? T_last_scan->translation().norm() : 0.0;
  step.gate_m = T_last_scan ? kGate_m + kGatePerMetre * travelled_m : options_.max_step_m;
  step.gate_rad = T_last_scan ? kGate_rad : kFreeGate_rad;
  const AutoSearch& auto_search = *localizer_->auto_search_;
  const std::vector<Hypothesis> found = auto_search.Find(scan, search, control, step.times);
  if (control.IsUnwanted()) return absl::CancelledError("nobody waits for the answer any more");
  for (const Hypothesis& hypothesis : found) {
    const Pose T_map_scan = auto_search.PoseInMap(scan.structure, hypothesis);
    const bool is_known =
        std::any_of(step.spots.begin(), step.spots.end(), [&](const Step::Spot& spot) {
          return PlanarDistance(spot.T_map_scan, T_map_scan) < VerifyOptions{}.rival_radius_m;
        });
    if (!is_known) step.spots.push_back({T_map_scan, hypothesis.score});
  }
  if (!step.spots.empty()) step.best_score = step.spots.front().score;
  const Calibration& calibration = localizer_->map().calibration;
  for (std::size_t i = 0; i < step.spots.size(); ++i) {
    const double rival = step.spots.size() < 2 ? 0.0 : step.spots[i == 0 ? 1 : 0].score;
    Step::Spot& spot = step.spots[i];
    spot.log_odds =
        std::clamp(LogOdds(calibration, {spot.score, rival}), -kMaxScanLogOdds, kMaxScanLogOdds);
    spot.unrivalled = Confidence(calibration, {spot.score, std::min(rival, kUnrelatedScore)});
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
  const SearchParams& least = localizer_->map().params.search;
  if (scan.num_voxels < static_cast<std::uint32_t>(least.min_voxels) ||
      scan.structure.posts.size() < kMinPosts) {
    absl::StatusOr<Answer> answer = localizer_->Localize(scan, options_.query, control);
    if (!answer.ok()) return answer.status();
    Move(T_last);
    return TrackedAnswer{.answer = *std::move(answer)};
  }
  const absl::StatusOr<Step> step = Look(scan, T_last, control);
  if (!step.ok()) return step.status();
  Move(T_last);
  Weigh(*step);
  return Tell(*step, control);
}

}  // namespace scanloc
