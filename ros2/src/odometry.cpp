#include "odometry.hpp"

#include <cmath>

namespace scanloc::ros2 {

bool Odometry::Add(const dataset::StampedPose& pose) {
  constexpr double kFastest_m_per_s = 100.0;
  constexpr double kLeast_m = 1.0;
  const std::optional<std::int64_t> newest = newest_ns();
  const bool is_of_other = newest && pose.parent != frame_;
  if (newest == pose.stamp_ns && !is_of_other) return false;  // a pose a time
  bool leaps = is_of_other;
  if (newest && !is_of_other) {
    const Pose& last = track_.samples().back().second;
    const double way_m = (pose.T_parent_child.translation() - last.translation()).norm();
    const double time_s = std::abs(1e-9 * static_cast<double>(pose.stamp_ns - *newest));
    leaps = way_m > kLeast_m + kFastest_m_per_s * time_s;
  }
  if (leaps || newest > pose.stamp_ns) track_ = {};
  frame_ = pose.parent;
  track_.Add(pose.stamp_ns, pose.T_parent_child);
  const auto& samples = track_.samples();
  if (samples.size() > kMaxSamples) {
    track_.ForgetBefore(samples[samples.size() / 2].first);
  } else if (samples.front().first < pose.stamp_ns - 2 * kKept_ns) {
    track_.ForgetBefore(pose.stamp_ns - kKept_ns);
  }
  return leaps;
}

std::optional<std::int64_t> Odometry::newest_ns() const {
  if (track_.samples().empty()) return std::nullopt;
  return track_.samples().back().first;
}

}  // namespace scanloc::ros2
