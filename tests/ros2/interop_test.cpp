// scanloc-ros2 among participants of another implementation of DDS, on loopback.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ros2/running_node.hpp"

namespace scanloc::test {
namespace {

TEST(RosNode, TellsWhereTheRobotIsAndEnds) {
  RunningNode node({"--map", Town().map1, "--once"});
  node.SendScan(Town().drive2, 12, kStart_ns);
  const auto bytes = node.robot.Next("/initialpose");
  ASSERT_TRUE(bytes.has_value());
  const PoseHeard heard = ReadPoseWithCovariance(*bytes);
  EXPECT_EQ(heard.stamp_ns, kStart_ns);
  EXPECT_EQ(heard.frame, "map");
  EXPECT_TRUE(heard.pose.translation().isApprox(AnswerOfCommandLine(Town().drive2, 12), 1e-6))
      << heard.pose.translation().transpose();
  EXPECT_GT(heard.covariance[0], 0.0);
  EXPECT_EQ(node.process.Wait(), 0) << node.process.stderr_text();
}

}  // namespace
}  // namespace scanloc::test
