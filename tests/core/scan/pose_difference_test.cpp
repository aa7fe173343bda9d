#include "scanloc/core/scan/pose_difference.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <numbers>

namespace scanloc {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Pose PoseOf(const Eigen::Vector3d& at, double yaw_deg = 0.0, double pitch_deg = 0.0,
            double roll_deg = 0.0) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(pitch_deg * kDegree, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = at;
  return pose;
}

TEST(PoseDifference, IsAcrossUpAlongUpAndAboutUp) {
  const PoseDifference difference =
      DifferenceOf(PoseOf({4.0, 6.0, 1.5}, 179.0), PoseOf({1.0, 2.0, 5.0}, -176.0));
  EXPECT_DOUBLE_EQ(difference.plane_m, 5.0);
  EXPECT_DOUBLE_EQ(difference.height_m, 3.5);
  EXPECT_NEAR(difference.heading_deg, 5.0, 1e-9);
}

TEST(PoseDifference, TellsTheHeadingOfAnyMount) {
  // Looking down, hanging, lying on the side: none has a yaw of its own that could be compared.
  for (const auto& [pitch_deg, roll_deg] : {std::pair(90.0, 0.0), {0.0, 180.0}, {0.0, -90.0}}) {
    const PoseDifference difference = DifferenceOf(PoseOf({0, 0, 0}, 70.0, pitch_deg, roll_deg),
                                                   PoseOf({0, 0, 0}, 30.0, pitch_deg, roll_deg));
    EXPECT_NEAR(difference.heading_deg, 40.0, 1e-9) << pitch_deg << " " << roll_deg;
  }
}

TEST(PoseDifference, FollowsTheUpDirectionOfTheMap) {
  // A map in a camera's frame: y points down.
  const Eigen::Vector3d up(0.0, -1.0, 0.0);
  Pose turned = Pose::Identity();
  turned.linear() = Eigen::AngleAxisd(25.0 * kDegree, up).toRotationMatrix();
  turned.translation() = Eigen::Vector3d(3.0, -3.5, 4.0);
  const PoseDifference difference = DifferenceOf(turned, Pose::Identity(), up);
  EXPECT_DOUBLE_EQ(difference.plane_m, 5.0);
  EXPECT_DOUBLE_EQ(difference.height_m, 3.5);
  EXPECT_NEAR(difference.heading_deg, 25.0, 1e-9);
}

TEST(MissOf, CountsEachOfTheThree) {
  EXPECT_FALSE(MissOf({1.0, 1.0, 10.0}).any());
  EXPECT_TRUE(MissOf({1.01, 0.0, 0.0}).plane);
  EXPECT_TRUE(MissOf({0.0, 1.01, 0.0}).height);
  EXPECT_TRUE(MissOf({0.0, 0.0, 10.01}).heading);
  EXPECT_FALSE(MissOf({0.0, 0.0, 10.01}).plane);
  EXPECT_TRUE(MissOf({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}).plane);
  EXPECT_FALSE(MissOf({4.0, 0.0, 0.0}, {.plane_m = 5.0}).any());
}

}  // namespace
}  // namespace scanloc
