#include "scanloc/core/loop_detector.hpp"

#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

constexpr double kMaxWindow_s = 1e6;
constexpr double kNsPerSecond = 1e9;

absl::StatusOr<Pose> Checked(const Pose& pose) {
  return PoseFromMatrix(pose.matrix().topRows<3>());
}

}  // namespace

absl::Status Validate(const LoopDetectorOptions& options) {
  if (absl::Status status = Validate(options.params); !status.ok()) return status;
  if (absl::Status status = Validate(options.query, options.params); !status.ok()) return status;
  if (!(options.window_s >= 0.0 && options.window_s <= kMaxWindow_s)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("window_s is %g; it must be in [0, %g]", options.window_s, kMaxWindow_s));
  }
  if (options.window_places < 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("window_places is %d; it must be from 0", options.window_places));
  }
  return absl::OkStatus();
}

LoopDetector::LoopDetector(const LoopDetectorOptions& options, Describer describer)
    : options_(options),
      describer_(std::move(describer)),
      map_(std::make_shared<Map>(MakeEmptyMap(options.params))),
      localizer_(new Localizer(map_)) {
  map_->sessions = {"drive"};
}

absl::StatusOr<LoopDetector> LoopDetector::Create(const LoopDetectorOptions& options) {
  if (absl::Status status = Validate(options); !status.ok()) return status;
  absl::StatusOr<Describer> describer = Describer::Create(options.params);
  if (!describer.ok()) return describer.status();
  LoopDetector detector(options, *std::move(describer));
  absl::Status status = detector.localizer_->Prepare(MethodOf(options.query, options.params));
  if (!status.ok()) return status;
  return detector;
}

absl::Status LoopDetector::CheckStamp(std::int64_t stamp_ns) const {
  if (!last_stamp_ns_ || stamp_ns >= *last_stamp_ns_) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "the scan's stamp %d ns is before that of the place added last, %d ns: give scans in order",
      stamp_ns, *last_stamp_ns_));
}

absl::StatusOr<std::int32_t> LoopDetector::Add(PointView scan, std::int64_t stamp_ns,
                                               const Pose& T_map_scan) {
  return Add(describer_.DescribePlace(scan), stamp_ns, T_map_scan);
}

absl::StatusOr<std::int32_t> LoopDetector::Add(PlaceDescriptor scan, std::int64_t stamp_ns,
                                               const Pose& T_map_scan) {
  if (absl::Status status = CheckStamp(stamp_ns); !status.ok()) return status;
  if (absl::Status status = Validate(scan, options_.params); !status.ok()) return status;
  const absl::StatusOr<Pose> pose = Checked(T_map_scan);
  if (!pose.ok()) return pose.status();
  const std::size_t number = num_places();
  if (number >= static_cast<std::size_t>(limits::kMaxPlaces)) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the detector holds %d places, as many as it may", number));
  }
  last_stamp_ns_ = stamp_ns;
  waiting_.push_back({{*pose, stamp_ns, 0}, std::move(scan)});
  return static_cast<std::int32_t>(number);
}

absl::Status LoopDetector::LetOut(std::int64_t now_ns) {
  const auto is_in_window = [&] {
    return waiting_.size() <= static_cast<std::size_t>(options_.window_places) ||
           // In doubles: stamps may lie as far from each other as they like.
           static_cast<double>(now_ns) - static_cast<double>(waiting_.front().place.stamp_ns) <
               options_.window_s * kNsPerSecond;
  };
  const std::size_t num_before = map_->places.size();
  while (!waiting_.empty() && !is_in_window()) {
    map_->AppendDescriptor(static_cast<std::int32_t>(map_->places.size()),
                           waiting_.front().descriptor);
    map_->places.push_back(waiting_.front().place);
    waiting_.pop_front();
  }
  return map_->places.size() == num_before ? absl::OkStatus() : localizer_->Extend();
}

absl::StatusOr<LoopAnswer> LoopDetector::Query(PointView scan, std::int64_t stamp_ns,
                                               const SearchControl& control) {
  return Query(describer_.Describe(scan), stamp_ns, control);
}

absl::StatusOr<LoopAnswer> LoopDetector::Query(const ScanDescriptor& scan, std::int64_t stamp_ns,
                                               const SearchControl& control) {
  if (absl::Status status = CheckStamp(stamp_ns); !status.ok()) return status;
  if (absl::Status status = LetOut(stamp_ns); !status.ok()) return status;
  absl::StatusOr<Answer> answer = localizer_->Localize(scan, options_.query, control);
  if (!answer.ok()) return answer.status();
  LoopAnswer said{.answer = *std::move(answer)};
  if (said.answer.outcome == Outcome::kLocalized) {
    const Candidate& best = said.answer.candidates.front();
    const Pose& T_map_place = map_->places[static_cast<std::size_t>(best.matched)].T_map_place;
    said.loop = Loop{best.matched, T_map_place.inverse() * best.T_map_query, std::nullopt};
    if (best.covariance) {
      said.loop->information =
          Rotated(T_map_place.linear().transpose(), *best.covariance).inverse();
    }
  }
  return said;
}

absl::Status LoopDetector::MovePlaces(std::span<const Pose> T_map_place) {
  if (T_map_place.size() != num_places()) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%d poses were given; the detector has %d places", T_map_place.size(), num_places()));
  }
  std::vector<Pose> poses;
  poses.reserve(T_map_place.size());
  for (const Pose& pose : T_map_place) {
    const absl::StatusOr<Pose> checked = Checked(pose);
    if (!checked.ok()) {
      return absl::InvalidArgumentError(
          absl::StrFormat("the pose of place %d: %s", poses.size(), checked.status().message()));
    }
    poses.push_back(*checked);
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Place& place =
        i < map_->places.size() ? map_->places[i] : waiting_[i - map_->places.size()].place;
    place.T_map_place = poses[i];
  }
  localizer_ = std::shared_ptr<Localizer>(new Localizer(map_));
  return localizer_->Prepare(MethodOf(options_.query, options_.params));
}

}  // namespace scanloc
