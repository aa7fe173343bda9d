// Plays a bag to a ROS 2 stack as a robot would, by Fast DDS on loopback, and prints what comes on
// /initialpose: for docs/ros2.md, on machines without ROS.
//   ros2_play_bag BAG [DOMAIN]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "ros2/ros_peer.hpp"
#include "ros2/ros_wire.hpp"
#include "scanloc/dataset/bag.hpp"

namespace scanloc::test {
namespace {

void PrintPose(const PoseHeard& heard) {
  const Eigen::Vector3d t = heard.pose.translation();
  const Eigen::Quaterniond q(heard.pose.linear());
  std::printf(
      "header:\n  stamp: {sec: %lld, nanosec: %lld}\n  frame_id: %s\n"
      "pose:\n  pose:\n    position: {x: %.3f, y: %.3f, z: %.3f}\n"
      "    orientation: {x: %.4f, y: %.4f, z: %.4f, w: %.4f}\n  covariance: [%.4f, ...]\n---\n",
      static_cast<long long>(heard.stamp_ns / 1'000'000'000),
      static_cast<long long>(heard.stamp_ns % 1'000'000'000), heard.frame.c_str(), t.x(), t.y(),
      t.z(), q.x(), q.y(), q.z(), q.w(), heard.covariance[0]);
}

int Play(const char* path, int domain) {
  const auto bag = dataset::Bag::Open({path});
  if (!bag.ok()) {
    std::fprintf(stderr, "%s\n", bag.status().ToString().c_str());
    return 1;
  }
  RosPeer robot(domain);
  robot.Subscribe("/initialpose", "geometry_msgs/PoseWithCovarianceStamped");
  std::vector<const dataset::BagTopic*> topics;
  for (const dataset::BagTopic& topic : (*bag)->topics()) {
    topics.push_back(&topic);
    robot.Advertise(topic.name, topic.type);
  }
  // As `ros2 bag play --wait-for-all-acked` would: who listens to the clouds is there.
  if (!robot.WaitForReader("/points") || !robot.WaitForWriter("/initialpose")) {
    std::fprintf(stderr, "no scanloc-ros2 in domain %d\n", domain);
    return 1;
  }
  std::int64_t before_ns = 0;
  const absl::Status played = (*bag)->ForEach(topics, [&](const dataset::BagMessage& message) {
    if (before_ns > 0) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(message.log_time_ns - before_ns));
    }
    before_ns = message.log_time_ns;
    const bool is_sent = robot.Publish(message.topic->name, std::string(message.bytes));
    return is_sent ? absl::OkStatus() : absl::InternalError("DDS takes no message");
  });
  const auto bytes = robot.Next("/initialpose", std::chrono::seconds(5));
  if (!played.ok() || !bytes) {
    std::fprintf(stderr, "no pose came; %s\n", played.ToString().c_str());
    return 1;
  }
  PrintPose(ReadPoseWithCovariance(*bytes));
  return 0;
}

}  // namespace
}  // namespace scanloc::test

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: %s BAG [DOMAIN]\n", argv[0]), 2;
  try {
    return scanloc::test::Play(argv[1], argc > 2 ? std::atoi(argv[2]) : 0);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
}
