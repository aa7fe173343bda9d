#include "odometry.hpp"

namespace scanloc::ros2 {

void Odometry::Add(const dataset::StampedPose& pose) {
  const std::optional<std::int64_t> newest = newest_ns();
  if (newest == pose.stamp_ns) return;  // a pose a time
  if (newest > pose.stamp_ns) track_ = {};
  track_.Add(pose.stamp_ns, pose.T_parent_child);
  const auto& samples = track_.samples();
  if (samples.size() > kMaxSamples) {
    track_.ForgetBefore(samples[samples.size() / 2].first);
  } else if (samples.front().first < pose.stamp_ns - 2 * kKept_ns) {
    track_.ForgetBefore(pose.stamp_ns - kKept_ns);
  }
}

std::optional<std::int64_t> Odometry::newest_ns() const {
  if (track_.samples().empty()) return std::nullopt;
  return track_.samples().back().first;
}

}  // namespace scanloc::ros2
