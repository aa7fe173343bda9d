#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lookout.hpp"
#include "ros2/ros_wire.hpp"

/// A Lookout with clouds, odometry and replies handed in.
namespace scanloc::ros2 {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kSecond = 1'000 * kMs;
inline constexpr std::int64_t kStart_ns = 1'700'000'000 * kSecond;

inline Pose At(double x, double y = 0.0, double yaw_rad = 0.0) {
  return Eigen::Translation3d(x, y, 0) * Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
}

inline absl::StatusOr<TrackedReply> Reply(Outcome outcome, const Pose& T_map_query = At(5)) {
  TrackedReply reply{.reply = {.map = "town"}};
  reply.reply.answer.outcome = outcome;
  reply.reply.answer.candidates.push_back({.confidence = 0.99, .T_map_query = T_map_query});
  return reply;
}
inline absl::StatusOr<TrackedReply> Localized(const Pose& T_map_query = At(5)) {
  return Reply(Outcome::kLocalized, T_map_query);
}
inline absl::StatusOr<TrackedReply> Missed() { return Reply(Outcome::kNotRecognized); }

class LookoutTest : public ::testing::Test {
 protected:
  void Begin(const LookoutOptions& options) { lookout.emplace(options); }
  /// And is found 110 m along the map, after the 10 m that the odometry tells of the first second.
  void BeginLocalized(const LookoutOptions& options) {
    Begin(options);
    (void)Odom(0, At(0));
    (void)Odom(1, At(10));
    Cloud(1);
    ASSERT_TRUE(Next().has_value());
    (void)Answer(Localized(At(110)));
  }

  /// A cloud of one point whose x is the stamp, in seconds since the start.
  void Cloud(double at_s) { Cloud(at_s, {{static_cast<float>(at_s), 0, 0}}, {}); }
  /// Of points that were seen so long after the stamp.
  void Cloud(double at_s, const PointCloud& points, const std::vector<float>& times_s) {
    auto bytes = std::make_shared<const std::string>(test::CloudBytes(
        points, kStart_ns + static_cast<std::int64_t>(at_s * 1e9), cloud_frame, times_s));
    const std::string_view view = *bytes;
    lookout->TakeCloud({.bytes = view, .owner = std::move(bytes)}, now_ns);
  }
  Told Odom(double at_s, const Pose& T_odom_base) {
    return lookout->TakeOdometry({.stamp_ns = kStart_ns + static_cast<std::int64_t>(at_s * 1e9),
                                  .parent = "odom",
                                  .child = "base_link",
                                  .T_parent_child = T_odom_base});
  }
  std::optional<Question> Next() { return lookout->NextQuestion(now_ns); }
  Told Answer(const absl::StatusOr<TrackedReply>& reply) {
    return lookout->TakeReply(reply, now_ns);
  }
  /// A cloud comes, is asked about and answered, with so many listeners; then so much time goes by.
  Told Round(const absl::StatusOr<TrackedReply>& reply, std::size_t num_listeners = 1) {
    Cloud(1e-9 * static_cast<double>(now_ns));
    EXPECT_TRUE(Next().has_value());
    Told told = Answer(reply);
    told.initial_pose = lookout->TakeListeners(num_listeners, now_ns).initial_pose;
    now_ns += 2 * kSecond;
    return told;
  }
  std::string Value(const std::string& key) {
    for (const auto& [name, value] : lookout->Diagnose(now_ns).values) {
      if (name == key) return value;
    }
    return "none";
  }

  std::optional<Lookout> lookout;
  std::string cloud_frame = "base_link";
  std::int64_t now_ns = 100 * kSecond;
};

}  // namespace scanloc::ros2
