#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"

/// The messages of ROS that scanloc-ros2 takes and publishes, without DDS.
namespace scanloc::ros2 {

/// A message as it came, in CDR with its head, not looked into yet. Cheap to copy.
struct ReceivedBytes {
  std::string_view bytes;
  std::shared_ptr<const void> owner;  ///< keeps the bytes
};

/// geometry_msgs/PoseWithCovarianceStamped.
struct PoseMessage {
  std::int64_t stamp_ns = 0;
  std::string frame;
  Pose pose = Pose::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();  ///< zeros: not known
};

/// geometry_msgs/PoseArray.
struct PosesMessage {
  std::int64_t stamp_ns = 0;
  std::string frame;
  std::vector<Pose> poses;
};

/// tf2_msgs/TFMessage with one transform.
struct TransformMessage {
  std::int64_t stamp_ns = 0;
  std::string parent;
  std::string child;
  Pose T_parent_child = Pose::Identity();
};

/// diagnostic_msgs/DiagnosticArray with one status.
struct DiagnosticMessage {
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };  // on the wire

  std::int64_t stamp_ns = 0;
  Level level = Level::kOk;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;
};

}  // namespace scanloc::ros2
