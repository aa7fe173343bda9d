#include "track/reckoned_pose.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "scanloc/core/scan/pose_difference.hpp"
#include "support/post_world.hpp"

namespace scanloc {
namespace {

using test::Offset;

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();
constexpr bool kReckonsHeight = true;
constexpr double kDegree = std::numbers::pi / 180.0;

TEST(ReckonedPose, FollowsTheOdometryAndIsDrawnToWhereScansAreFound) {
  ReckonedPose pose(Offset(10.0, 0.0, 2.0, 0.0));
  for (int i = 1; i <= 20; ++i) {
    pose.Move(Offset(1.0, 0.05, 0.0, 0.0));  // it slips aside
    EXPECT_DOUBLE_EQ(pose.unseen_m(), std::hypot(1.0, 0.05));
    pose.Correct(Offset(10.0 + i, 0.0, 2.0, 0.0), 1.0, kReckonsHeight, kUp);
    EXPECT_EQ(pose.unseen_m(), 0.0);
  }
  const PoseDifference off = DifferenceOf(pose.T_map_scan(), Offset(30.0, 0.0, 2.0, 0.0), kUp);
  EXPECT_LT(off.plane_m, 0.2);
  EXPECT_LT(off.heading_deg, 0.1);
}

TEST(ReckonedPose, HardlyMovesForAFindingFarOff) {
  ReckonedPose pose(Pose::Identity());
  for (int i = 1; i <= 5; ++i) {
    pose.Move(Offset(1.0, 0.0, 0.0, 0.0));
    pose.Correct(Offset(i, 0.0, 0.0, 0.0), 1.0, kReckonsHeight, kUp);
  }
  pose.Move(Offset(1.0, 0.0, 0.0, 0.0));
  const Pose found = Offset(6.0, 1.0, 1.5, 9.0 * kDegree, 30.0 * kDegree);
  pose.Correct(found, 1.0, kReckonsHeight, kUp);
  EXPECT_LT(pose.T_map_scan().translation().y(), 0.2);
  EXPECT_LT(pose.T_map_scan().translation().z(), 0.3);
  EXPECT_LT(std::abs(Yaw(pose.T_map_scan())), 2.0 * kDegree);
  EXPECT_GT(pose.T_map_scan().linear()(2, 2), std::cos(6.0 * kDegree));
  EXPECT_TRUE(pose.IsFarFrom(found, kUp));
}

TEST(ReckonedPose, ComesRoundWhenAllThatFollowsIsElsewhere) {
  ReckonedPose pose(Pose::Identity());
  for (int i = 0; i < 40; ++i) {
    pose.Move(Offset(1.0, 0.0, 0.0, 0.0));
    pose.Correct(Offset(i + 1.0, 1.0, 0.0, 0.0), 1.0, kReckonsHeight, kUp);
  }
  EXPECT_NEAR(pose.T_map_scan().translation().y(), 1.0, 0.3);
}

TEST(ReckonedPose, RisesWithTheScansWhereTheOdometryKnowsOnlyAPlane) {
  EXPECT_FALSE(ReckonsHeight(Offset(1.0, 0.2, 0.0, 0.3)));
  EXPECT_TRUE(ReckonsHeight(Offset(1.0, 0.2, 0.001, 0.3)));
  EXPECT_TRUE(ReckonsHeight(Offset(1.0, 0.2, 0.0, 0.3, 0.001)));
  ReckonedPose pose(Pose::Identity());
  pose.Move(Offset(1.0, 0.0, 0.0, 0.0));
  pose.Correct(Offset(1.0, 0.0, 0.7, 0.0, 0.1), 1.0, !kReckonsHeight, kUp);
  EXPECT_DOUBLE_EQ(pose.T_map_scan().translation().z(), 0.7);
  EXPECT_NEAR(pose.T_map_scan().linear()(2, 2), std::cos(0.1), 1e-9);
}

}  // namespace
}  // namespace scanloc
