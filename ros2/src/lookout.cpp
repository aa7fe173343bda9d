#include "lookout.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/deskew.hpp"

namespace scanloc::ros2 {
namespace {

std::int64_t Ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

/// Whether the same question may well be answered later.
bool IsPassing(const absl::Status& error) {
  return absl::IsUnavailable(error) || absl::IsDeadlineExceeded(error) ||
         absl::IsResourceExhausted(error) || absl::IsAborted(error) || absl::IsCancelled(error);
}

}  // namespace

Lookout::Lookout(const LookoutOptions& options)
    : options_(options), odom_frame_(options.odom_frame) {
  if (options.asks_at_start) BeginAnew();
}

void Lookout::BeginAnew() {
  state_ = State::kSearching;
  is_answered_ = false;
  is_announced_ = false;
  begins_anew_ = true;
  T_odom_last_.reset();
  unheard_.reset();
  T_map_odom_.reset();
  not_before_ns_ = 0;
  num_errors_in_row_ = 0;
  num_misses_in_row_ = 0;
  problem_.clear();
}

void Lookout::TakeTrigger() {
  is_outdated_ = asked_.has_value();
  // What the sensor saw before may be of another place, long ago.
  if (waiting_ || decoded_) ++counts_.passed_over;
  waiting_.reset();
  decoded_.reset();
  BeginAnew();
}

void Lookout::TakeCloud(ReceivedBytes cloud, std::int64_t now_ns) {
  ++counts_.received;
  cloud_at_ns_ = now_ns;
  if (waiting_) ++counts_.passed_over;
  waiting_ = std::move(cloud);
}

Told Lookout::TakeOdometry(const dataset::StampedPose& pose) {
  dataset::StampedPose of_base = pose;
  unconnected_.clear();
  odom_parent_ = pose.parent;
  if (!pose.child.empty() && pose.child != options_.base_frame) {
    const auto chain = static_frames_.Connect(pose.child, options_.base_frame);
    const auto T_child_base = chain.ok() ? chain->At(pose.stamp_ns) : std::nullopt;
    if (!T_child_base) {
      // Taken for the base's, it would put the frames off by where the body sits on the robot.
      unconnected_ = pose.child;
      return {};
    }
    of_base.T_parent_child = pose.T_parent_child * *T_child_base;
  }
  if (odometry_.Add(of_base)) {
    T_odom_asked_.reset();
    last_reply_.reset();
    begins_anew_ = true;
    // Where the map lies in what is counted from now on is not known.
    if (T_map_odom_) Lose();
  }
  if (options_.odom_frame.empty()) odom_frame_ = pose.parent;
  Told told;
  if (options_.publishes_tf && state_ == State::kLocalized && T_map_odom_ && HasOdomFrame()) {
    told.map_odom = TransformMessage{.stamp_ns = pose.stamp_ns,
                                     .parent = options_.map_frame,
                                     .child = odom_frame_,
                                     .T_parent_child = *T_map_odom_};
  }
  return told;
}

void Lookout::TakeStaticTransform(const dataset::StampedPose& pose) {
  if (static_frames_.size() < kMaxStaticFrames) static_frames_.Add(pose, true);
}

std::optional<Pose> Lookout::MountOf(const std::string& frame) const {
  if (options_.knows_base) return options_.mount.T_base_sensor;
  if (frame == options_.base_frame) return Pose::Identity();
  const auto chain = static_frames_.Connect(options_.base_frame, frame);
  return chain.ok() ? chain->At(0) : std::nullopt;
}

bool Lookout::AwaitsMount(std::int64_t now_ns) const {
  return now_ns < first_decoded_at_ns_ + kMountWait_ns && !MountOf(decoded_->head.frame);
}

Told Lookout::TakeListeners(std::size_t num_listeners, std::int64_t now_ns) {
  Told told;
  if (now_ns >= unheard_until_ns_) unheard_.reset();
  if (unheard_ && num_listeners > 0) {
    told.initial_pose = *std::exchange(unheard_, std::nullopt);
    is_announced_ = true;
  }
  return told;
}

bool Lookout::WantsScan() const {
  if (asked_ || state_ == State::kIdle || !failure_.ok()) return false;
  switch (options_.mode) {
    case Mode::kOnce:
      return !is_answered_;
    case Mode::kUntilLocalized:
      if (state_ != State::kLocalized) return true;
      return options_.publishes_tf ? !T_map_odom_ : !is_announced_;
    case Mode::kAlways:
      break;
  }
  return true;
}

void Lookout::Decode(std::int64_t now_ns) {
  const ReceivedBytes cloud = *std::exchange(waiting_, std::nullopt);
  if (now_ns > cloud_at_ns_ + kOutdated_ns) {
    ++counts_.passed_over;
    return;
  }
  auto decoded = dataset::DecodeCloud(dataset::WireFormat::kCdr, cloud.bytes, options_.deskews);
  if (!decoded.ok()) {
    ++counts_.refused;
    cloud_problem_ = absl::StrCat(decoded.status().message());
    return;
  }
  cloud_problem_.clear();
  decoded_ = *std::move(decoded);
  decoded_at_ns_ = now_ns;
  sweep_end_ns_ = decoded_->head.stamp_ns;
  for (const float offset_s : decoded_->offsets_s) {
    sweep_end_ns_ = std::max(sweep_end_ns_, decoded_->head.stamp_ns + Ns(offset_s));
  }
  if (first_decoded_at_ns_ == 0) first_decoded_at_ns_ = now_ns;
}

bool Lookout::AwaitsOdometry(std::int64_t now_ns) const {
  const std::optional<std::int64_t> newest_ns = odometry_.newest_ns();
  return newest_ns && *newest_ns < sweep_end_ns_ &&
         now_ns < decoded_at_ns_ + Ns(options_.odometry_wait_s);
}

void Lookout::TakeMotionOut(const Pose& T_base_sensor, dataset::CloudMessage& cloud) {
  if (cloud.offsets_s.empty() || cloud.offsets_s.size() != cloud.scan.points.size()) return;
  const auto sensor_at = [&](std::int64_t stamp_ns) {
    std::optional<Pose> T_odom_sensor = odometry_.At(stamp_ns);
    if (T_odom_sensor) *T_odom_sensor = *T_odom_sensor * T_base_sensor;
    return T_odom_sensor;
  };
  if (dataset::Deskew(sensor_at, cloud.head.stamp_ns, cloud.offsets_s, cloud.scan.points)) {
    ++counts_.deskewed;
  }
}

std::optional<Question> Lookout::NextQuestion(std::int64_t now_ns) {
  if (!WantsScan() || now_ns < not_before_ns_) return std::nullopt;
  if (!decoded_ && waiting_) Decode(now_ns);
  if (!decoded_ || AwaitsOdometry(now_ns) || AwaitsMount(now_ns)) return std::nullopt;
  dataset::CloudMessage cloud = *std::exchange(decoded_, std::nullopt);
  if (StandsStill(cloud.head.frame)) {
    ++counts_.refused;
    cloud_problem_ = absl::StrCat("it is in \"", cloud.head.frame,
                                  "\", which does not move with the robot; name the topic of the "
                                  "clouds that are in the frame of the sensor or of the robot");
    return std::nullopt;
  }

  // Time began anew: a bag is played again.
  if (cloud.head.stamp_ns < last_stamp_ns_) begins_anew_ = true;
  if (begins_anew_) T_odom_last_.reset();
  Question question{.mount = options_.mount, .begins_anew = begins_anew_};
  const std::optional<Pose> T_base_sensor = MountOf(cloud.head.frame);
  has_mount_ = T_base_sensor.has_value();
  question.mount.T_base_sensor = T_base_sensor.value_or(Pose::Identity());
  T_odom_asked_.reset();
  if (has_mount_) {  // how the base moves says else nothing of the sensor
    TakeMotionOut(*T_base_sensor, cloud);
    T_odom_asked_ = odometry_.At(cloud.head.stamp_ns);
  }
  question.scan = std::move(cloud.scan.points);
  if (T_odom_asked_) {
    if (T_odom_last_) question.T_last_scan = T_odom_last_->inverse() * *T_odom_asked_;
  } else if (odometry_.newest_ns()) {
    ++counts_.without_odometry;
  }
  last_stamp_ns_ = cloud.head.stamp_ns;
  cloud_frame_ = cloud.head.frame;
  asked_ = std::move(cloud.head);
  asked_at_ns_ = now_ns;
  begins_anew_ = false;
  ++counts_.asked;
  return question;
}

Told Lookout::TakeReply(const absl::StatusOr<TrackedReply>& reply, std::int64_t now_ns) {
  const dataset::MessageHead head = *std::exchange(asked_, std::nullopt);
  Told told;
  if (std::exchange(is_outdated_, false)) {
    begins_anew_ = true;
    return told;
  }
  if (!reply.ok()) {
    TakeError(reply.status(), now_ns);
    return told;
  }
  is_answered_ = true;
  num_errors_in_row_ = 0;
  problem_.clear();
  T_odom_last_ = T_odom_asked_;
  last_reply_ = reply->reply;
  const Answer& answer = reply->reply.answer;
  if (answer.outcome == Outcome::kLocalized && !answer.candidates.empty()) {
    told.pose = TakeLocalized(*reply, head, now_ns);
  } else {
    TakeMiss();
  }
  told.candidates = PosesMessage{.stamp_ns = head.stamp_ns, .frame = options_.map_frame};
  for (const Candidate& candidate : answer.candidates) {
    told.candidates->poses.push_back(candidate.T_map_query);
  }
  return told;
}

void Lookout::TakeError(const absl::Status& error, std::int64_t now_ns) {
  constexpr std::int64_t kFirst_ns = 250'000'000;
  constexpr int kMostDoublings = 4;
  ++counts_.errors;
  problem_ = absl::StrCat(error.message());
  begins_anew_ = true;  // the stream is over
  if (options_.mode == Mode::kOnce && !IsPassing(error)) failure_ = error;
  not_before_ns_ = now_ns + (kFirst_ns << std::min(num_errors_in_row_, kMostDoublings));
  ++num_errors_in_row_;
}

PoseMessage Lookout::TakeLocalized(const TrackedReply& reply, const dataset::MessageHead& head,
                                   std::int64_t now_ns) {
  const Candidate& best = reply.reply.answer.candidates.front();
  PoseMessage pose{.stamp_ns = head.stamp_ns,
                   .frame = options_.map_frame,
                   .pose = best.T_map_query,
                   .covariance = best.covariance.value_or(PoseCovariance::Zero())};
  if (state_ != State::kLocalized || reply.is_relocated) is_announced_ = false;
  state_ = State::kLocalized;
  num_misses_in_row_ = 0;
  not_before_ns_ = asked_at_ns_ + Ns(options_.interval_s);
  if (!is_announced_) {
    unheard_ = pose;
    unheard_until_ns_ = now_ns + kUnheard_ns;
  }
  if (reply.is_relocated) T_map_odom_.reset();
  if (options_.publishes_tf && T_odom_asked_)
    T_map_odom_ = best.T_map_query * T_odom_asked_->inverse();
  return pose;
}

void Lookout::TakeMiss() {
  ++num_misses_in_row_;
  not_before_ns_ = asked_at_ns_ + kSearchInterval_ns;
  if (state_ == State::kLocalized && num_misses_in_row_ >= options_.num_misses_to_lost) {
    Lose();
  }
}

void Lookout::Lose() {
  state_ = State::kLost;
  unheard_.reset();
  T_map_odom_.reset();  // silent rather than wrong
}

std::int64_t Lookout::NextChange_ns() const {
  std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
  if (WantsScan() && waiting_) next_ns = not_before_ns_;
  if (WantsScan() && decoded_) {
    next_ns = decoded_at_ns_ + Ns(options_.odometry_wait_s);
    if (!MountOf(decoded_->head.frame)) {
      next_ns = std::max(next_ns, first_decoded_at_ns_ + kMountWait_ns);
    }
    next_ns = std::max(next_ns, not_before_ns_);
  }
  if (unheard_) next_ns = std::min(next_ns, unheard_until_ns_);
  return next_ns;
}

bool Lookout::IsDone(std::int64_t now_ns) const {
  if (!failure_.ok()) return true;
  if (options_.stays || asked_) return false;
  switch (options_.mode) {
    case Mode::kOnce:
      return is_answered_ && (!unheard_ || now_ns >= unheard_until_ns_);
    case Mode::kUntilLocalized:
      return state_ == State::kLocalized && is_announced_;
    case Mode::kAlways:
      break;
  }
  return false;
}

}  // namespace scanloc::ros2
