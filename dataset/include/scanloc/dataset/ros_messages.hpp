#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/gnss_fixes.hpp"
#include "scanloc/dataset/scan_reader.hpp"

/// The messages of ROS that are read, from their bytes.
namespace scanloc::dataset {

/// std_msgs/Header.
struct MessageHead {
  std::int64_t stamp_ns = 0;
  std::string frame;  ///< without a leading "/"
};

/// The header of a message that begins with one.
[[nodiscard]] absl::StatusOr<MessageHead> DecodeHead(WireFormat format, std::string_view bytes);

/// sensor_msgs/PointCloud2.
struct CloudMessage {
  MessageHead head;
  Scan scan;
  /// When each point was measured, from the stamp of the header [s]; empty if no field says it, or
  /// nobody asked.
  std::vector<float> offsets_s;
};

/// Points of any layout: fields x, y and z of FLOAT32 or FLOAT64 anywhere among others, both byte
/// orders, rows with or without padding. Times are a field named t, time, timestamp, time_stamp or
/// offset_time, in the unit that makes a sweep of 1 ms to 2 s of them, from the stamp or absolute;
/// intensities those of ReadScanWithIntensities.
/// InvalidArgument if the message is not whole, announces more than limits::kMaxPointsPerScan
/// points, or has fields that do not lie within a point.
[[nodiscard]] absl::StatusOr<CloudMessage> DecodeCloud(WireFormat format, std::string_view bytes,
                                                       bool with_times,
                                                       bool with_intensities = false);

/// A transform between two frames at a time.
struct StampedPose {
  std::int64_t stamp_ns = 0;
  std::string parent;
  std::string child;  ///< empty: the message names none
  Pose T_parent_child = Pose::Identity();
};

/// Whether DecodePoses reads messages of a type.
[[nodiscard]] bool IsPoseType(std::string_view type);
[[nodiscard]] bool IsTransformType(std::string_view type);
inline constexpr std::string_view kCloudType = "sensor_msgs/PointCloud2";

inline constexpr std::string_view kFixType = "sensor_msgs/NavSatFix";
/// None: the receiver says that it has no fix. InvalidArgument if the message is not whole.
[[nodiscard]] absl::StatusOr<std::optional<GnssFix>> DecodeFix(WireFormat format,
                                                               std::string_view bytes);

/// nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped and TransformStamped,
/// and tf's messages. Transforms that are none (not finite, no rotation) are left out and counted.
/// InvalidArgument if the message is not whole.
[[nodiscard]] absl::StatusOr<std::vector<StampedPose>> DecodePoses(std::string_view type,
                                                                   WireFormat format,
                                                                   std::string_view bytes,
                                                                   std::size_t& num_bad);

}  // namespace scanloc::dataset
