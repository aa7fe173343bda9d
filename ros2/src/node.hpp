#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "messages.hpp"
#include "scanloc/dataset/ros_messages.hpp"

namespace scanloc::ros2 {

struct NodeOptions {
  int domain = 0;                            ///< of DDS, in [0, 230]; ROS_DOMAIN_ID
  std::string ros_namespace;                 ///< of topics that do not begin with "/"
  std::string points = "points";             ///< this and the next three: what is read
  std::string odom = "odom";                 ///< empty: none
  std::string tf_static = "tf_static";       ///< empty: none
  std::string trigger;                       ///< empty: none
  std::string initial_pose = "initialpose";  ///< this and the rest: what is published
  std::string pose = "scanloc/pose";
  std::string candidates = "scanloc/candidates";
  std::string diagnostics = "/diagnostics";
  std::string tf;            ///< empty: none
  bool is_reliable = false;  ///< ask the clouds' publisher to send again what got lost
  int depth = 5;             ///< messages of a topic kept until they are looked at, in [1, 1000]
};

/// The robot's topics, over DDS. One thread, but for Wake.
class Node {
 public:
  /// InvalidArgument: names that are none. Internal: DDS does not start, with its reason.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Node>> Create(const NodeOptions& options);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// What came, in the order of each topic.
  struct Received {
    std::vector<ReceivedBytes> clouds;
    std::vector<dataset::StampedPose> odometry;
    std::vector<dataset::StampedPose> static_transforms;
    bool has_trigger = false;
  };
  /// Waits until something comes, Wake is called, or the time is over. At most so many messages of
  /// a topic are handed out at once; the others come next.
  static constexpr std::size_t kMaxAtOnce = 64;
  [[nodiscard]] Received Wait(std::chrono::nanoseconds at_most);
  /// Ends a Wait under way, or the next. Any thread.
  void Wake();

  void PublishInitialPose(const PoseMessage& message);
  void PublishPose(const PoseMessage& message);
  void PublishCandidates(const PosesMessage& message);
  void PublishTransform(const TransformMessage& message);
  void Publish(const DiagnosticMessage& message);
  /// Waits until who subscribes has got the initial pose; false if the time is over before.
  [[nodiscard]] bool Flush(std::chrono::nanoseconds at_most);

  /// How many subscribe to the initial pose.
  [[nodiscard]] std::size_t num_listeners() const;

  /// What there is to say about the topics beside the messages; a problem is empty where there is
  /// none.
  struct Health {
    std::size_t num_cloud_publishers = 0;
    /// Of any topic: messages that were no such message, and datagrams that the kernel dropped.
    std::size_t num_malformed = 0;
    std::uint64_t num_dropped_datagrams = 0;
    std::string problem;
  };
  [[nodiscard]] Health health() const;

 private:
  struct Impl;
  explicit Node(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace scanloc::ros2
