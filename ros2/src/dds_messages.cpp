#include "dds_messages.hpp"

#include <algorithm>
#include <cstdint>

namespace scanloc::ros2 {
namespace {

// The generated types have no const; nobody writes to what is sent.
char* Text(const std::string& text) { return const_cast<char*>(text.c_str()); }

std_msgs_msg_dds__Header_ Head(std::int64_t stamp_ns, const std::string& frame) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  std::int64_t seconds = stamp_ns / kNsPerS;
  std::int64_t rest_ns = stamp_ns % kNsPerS;
  if (rest_ns < 0) {
    --seconds;
    rest_ns += kNsPerS;
  }
  return {.stamp_ = {.sec_ = static_cast<std::int32_t>(seconds),
                     .nanosec_ = static_cast<std::uint32_t>(rest_ns)},
          .frame_id_ = Text(frame)};
}

geometry_msgs_msg_dds__Quaternion_ Rotation(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {.x_ = q.x(), .y_ = q.y(), .z_ = q.z(), .w_ = q.w()};
}

geometry_msgs_msg_dds__Pose_ ToDds(const Pose& pose) {
  const auto& t = pose.translation();
  return {.position_ = {.x_ = t.x(), .y_ = t.y(), .z_ = t.z()}, .orientation_ = Rotation(pose)};
}

/// A sequence that lends its elements.
template <typename Sequence, typename Element>
Sequence Lent(Element* elements, std::size_t num) {
  Sequence sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(num);
  sequence._buffer = elements;
  sequence._release = false;
  return sequence;
}

}  // namespace

geometry_msgs_msg_dds__PoseWithCovarianceStamped_ ToDds(const PoseMessage& message) {
  geometry_msgs_msg_dds__PoseWithCovarianceStamped_ dds{.header_ =
                                                            Head(message.stamp_ns, message.frame)};
  dds.pose_.pose_ = ToDds(message.pose);
  const auto covariance = message.covariance.reshaped();  // symmetric: rows are columns
  std::copy(covariance.begin(), covariance.end(), dds.pose_.covariance_);
  return dds;
}

geometry_msgs_msg_dds__PoseArray_ ToDds(const PosesMessage& message,
                                        std::vector<geometry_msgs_msg_dds__Pose_>& parts) {
  parts.clear();
  for (const Pose& pose : message.poses) parts.push_back(ToDds(pose));
  geometry_msgs_msg_dds__PoseArray_ dds{.header_ = Head(message.stamp_ns, message.frame)};
  dds.poses_ = Lent<decltype(dds.poses_)>(parts.data(), parts.size());
  return dds;
}

tf2_msgs_msg_dds__TFMessage_ ToDds(const TransformMessage& message,
                                   geometry_msgs_msg_dds__TransformStamped_& part) {
  const auto& t = message.T_parent_child.translation();
  part = {.header_ = Head(message.stamp_ns, message.parent),
          .child_frame_id_ = Text(message.child),
          .transform_ = {.translation_ = {.x_ = t.x(), .y_ = t.y(), .z_ = t.z()},
                         .rotation_ = Rotation(message.T_parent_child)}};
  tf2_msgs_msg_dds__TFMessage_ dds{};
  dds.transforms_ = Lent<decltype(dds.transforms_)>(&part, 1);
  return dds;
}

diagnostic_msgs_msg_dds__DiagnosticArray_ ToDds(
    const DiagnosticMessage& message, diagnostic_msgs_msg_dds__DiagnosticStatus_& part,
    std::vector<diagnostic_msgs_msg_dds__KeyValue_>& values) {
  static const std::string name = "scanloc-ros2: localization";
  static const std::string none;
  values.clear();
  for (const auto& [key, value] : message.values) {
    values.push_back({.key_ = Text(key), .value_ = Text(value)});
  }
  part = {.level_ = static_cast<std::uint8_t>(message.level),
          .name_ = Text(name),
          .message_ = Text(message.message),
          .hardware_id_ = Text(none)};
  part.values_ = Lent<decltype(part.values_)>(values.data(), values.size());
  diagnostic_msgs_msg_dds__DiagnosticArray_ dds{.header_ = Head(message.stamp_ns, none)};
  dds.status_ = Lent<decltype(dds.status_)>(&part, 1);
  return dds;
}

}  // namespace scanloc::ros2
