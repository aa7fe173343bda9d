#include "scanloc/core/track/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "map/narrowing.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"
#include "track/tracks.hpp"

namespace scanloc {

Tracker::Tracker(std::shared_ptr<const Localizer> localizer, const TrackerOptions& options)
    : localizer_(std::move(localizer)),
      options_(options),
      tracks_(std::make_unique<Tracks>(localizer_->map().params.automatic.track)) {}

Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

std::size_t Tracker::num_tracks() const { return tracks_->tracks().size(); }

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
  *tracks_ = Tracks(localizer_->map().params.automatic.track);
  last_localized_ = 0;
}

TrackedAnswer Tracker::Tell(const StageTimes& times, const SearchControl& control) {
  const Map& map = localizer_->map();
  TrackedAnswer told;
  Answer& answer = told.answer;
  answer.content_id = map.content_id;
  answer.times = times;
  std::vector<Track> tracks = tracks_->tracks();
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.total() > b.total(); });
  // Against each other and against being nowhere in the map; with what the last scan alone says and
  // without, whichever is less sure.
  double sum = 1.0;
  double sum_in_a_row = 1.0;
  for (const Track& track : tracks) {
    sum += std::exp(track.total());
    sum_in_a_row += std::exp(track.standing());
  }
  const auto confidence_of = [&](const Track& track) {
    return std::min(std::exp(track.total()) / sum, std::exp(track.standing()) / sum_in_a_row);
  };
  for (const Track& track : tracks) {
    if (static_cast<int>(answer.candidates.size()) >= options_.query.max_answers) break;
    auto candidate = localizer_->auto_search_->CandidateAt(
        track.pose.T_map_scan(), track.covariance, track.score, confidence_of(track), control);
    if (candidate) answer.candidates.push_back(*std::move(candidate));
  }
  if (answer.candidates.empty()) {
    answer.reason = "the map has no place to compare with";
    return told;
  }
  const Track& best = tracks.front();
  told.num_scans = best.num_scans;
  const double least = options_.query.min_confidence.value_or(map.params.search.min_confidence);
  const double confidence = confidence_of(best);
  if (confidence >= least) {
    answer.outcome = Outcome::kLocalized;
    told.is_relocated = last_localized_ != 0 && last_localized_ != best.id;
    last_localized_ = best.id;
    answer.reason = absl::StrFormat("%d scans agree on the spot%s", best.num_scans,
                                    told.is_relocated ? ", which is not where the robot was" : "");
  } else if (best.unrivalled >= least && tracks.size() > 1) {
    answer.outcome = Outcome::kAmbiguous;
    answer.reason = absl::StrFormat(
        "distinct spots explain the last scans: the best has a probability of %.2f, the next %.2f",
        confidence, confidence_of(tracks[1]));
  } else {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = absl::StrFormat(
        "the scans speak for no spot: the best has a probability of %.2f", confidence);
  }
  return told;
}

absl::StatusOr<Look> Tracker::LookAt(const ScanDescriptor& scan,
                                     const std::optional<Pose>& T_last_scan,
                                     const SearchControl& control, StageTimes& times) const {
  const Params& of_map = localizer_->map().params;
  const EvidenceParams& evidence = of_map.automatic.evidence;
  const TrackParams& params = of_map.automatic.track;
  const AutoSearch& auto_search = *localizer_->auto_search_;
  AutoSearch::Options search{.shortlist = options_.query.num_candidates.value_or(0),
                             .num_supported = params.num_supported,
                             .num_measured = params.num_supported,
                             .are_predicted_near = T_last_scan.has_value()};
  for (const Track& track : tracks_->tracks()) {
    const Pose& T_map_last = track.pose.T_map_scan();
    search.predicted.push_back(T_last_scan ? T_map_last * *T_last_scan : T_map_last);
  }
  const absl::StatusOr<std::vector<Spot>> spots = auto_search.Find(scan, search, control, times);
  if (control.IsUnwanted()) return absl::CancelledError("nobody waits for the answer any more");
  if (!spots.ok()) return spots.status();
  Look look{.up = auto_search.up(),
            .ground_m = scan.structure.height_m,
            .T_last_scan = T_last_scan,
            .max_step_m = options_.max_step_m};
  if (spots->empty()) return look;
  const Support& best = *spots->front().support;
  look.genuine = std::clamp(GenuineLogOdds(best, 0.0, evidence), -params.max_scan_log_odds,
                            params.max_scan_log_odds);
  look.stands_alone = ConfidencesOf(*spots, evidence, auto_search.up()).front() >=
                      options_.query.min_confidence.value_or(of_map.search.min_confidence);
  const double best_score = spots->front().score;
  for (const Spot& spot : *spots) {
    const Support& support = spot.support ? *spot.support : best;
    const double in_a_row =
        RivalryLogOddsInARow(best_score, spot.score, support.num_posts, evidence);
    const double rivalry = RivalryLogOdds(best_score, spot.score, support.num_posts, evidence);
    look.spots.push_back({spot.T_map_query, spot.covariance, spot.hypothesis.score,
                          Logistic(SupportLogOdds(support, evidence)), in_a_row,
                          std::min(rivalry - in_a_row, params.max_scan_log_odds)});
  }
  return look;
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
    tracks_->PassBlindly(T_last);
    return TrackedAnswer{.answer = *std::move(answer)};
  }
  StageTimes times;
  const absl::StatusOr<Look> look = LookAt(scan, T_last, within, times);
  if (!look.ok()) return look.status();
  tracks_->Weigh(*look);
  return Tell(times, within);
}

}  // namespace scanloc
