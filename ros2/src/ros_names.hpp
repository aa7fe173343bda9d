#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace scanloc::ros2 {

/// The name that DDS knows a topic of ROS by: "rt/robot1/points" for "points" in the namespace
/// "/robot1". A name that begins with "/" stands as it is. InvalidArgument if the name is none:
/// parts of letters, digits and "_", not beginning with a digit, with single "/" between them.
[[nodiscard]] absl::StatusOr<std::string> DdsTopicName(const std::string& ros_namespace,
                                                       const std::string& topic);

}  // namespace scanloc::ros2
