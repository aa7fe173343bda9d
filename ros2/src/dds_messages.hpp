#pragma once

#include <vector>

#include "messages.hpp"
#include "ros_messages.h"  // made of idl/ros_messages.idl

/// Our messages as DDS takes them. What they point to belongs to the message, or to the list of
/// parts handed in, and must outlive the result.
namespace scanloc::ros2 {

[[nodiscard]] geometry_msgs_msg_dds__PoseWithCovarianceStamped_ ToDds(const PoseMessage& message);

[[nodiscard]] geometry_msgs_msg_dds__PoseArray_ ToDds(
    const PosesMessage& message, std::vector<geometry_msgs_msg_dds__Pose_>& parts);

/// The one transform is `part`.
[[nodiscard]] tf2_msgs_msg_dds__TFMessage_ ToDds(const TransformMessage& message,
                                                 geometry_msgs_msg_dds__TransformStamped_& part);

/// The one status is `part`, its values are `values`.
[[nodiscard]] diagnostic_msgs_msg_dds__DiagnosticArray_ ToDds(
    const DiagnosticMessage& message, diagnostic_msgs_msg_dds__DiagnosticStatus_& part,
    std::vector<diagnostic_msgs_msg_dds__KeyValue_>& values);

}  // namespace scanloc::ros2
