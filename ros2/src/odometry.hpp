#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/frame_tree.hpp"
#include "scanloc/dataset/ros_messages.hpp"

namespace scanloc::ros2 {

/// The robot's own reckoning of the last seconds: T_odom_base over time.
class Odometry {
 public:
  /// Of this much time, and at most kMaxSamples, poses are kept.
  static constexpr std::int64_t kKept_ns = 10'000'000'000;
  static constexpr std::size_t kMaxSamples = 20'000;

  /// Takes a message of odometry. A stamp from before the newest forgets all that was there: time
  /// began anew, as when a bag is played again. So does a leap, and says so: a way that no robot
  /// goes in the time since the newest, as where odometry began anew, or another frame.
  bool Add(const dataset::StampedPose& pose);

  /// Interpolated; none outside of what is known.
  [[nodiscard]] std::optional<Pose> At(std::int64_t stamp_ns) const { return track_.At(stamp_ns); }

  /// Of the newest message; none before the first.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const;

 private:
  std::string frame_;  // of the track, its parent
  dataset::PoseTrack track_;
};

}  // namespace scanloc::ros2
