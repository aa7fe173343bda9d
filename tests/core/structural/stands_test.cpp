#include "structural/stands.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace scanloc {
namespace {

Pose At(double x_m, double y_m, double heading_deg) {
  Pose pose = Pose::Identity();
  pose.translate(Eigen::Vector3d(x_m, y_m, 0.0));
  pose.rotate(Eigen::AngleAxisd(heading_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ()));
  return pose;
}

TEST(Stands, AreBesideWhoIsNearAndLooksTheSameWay) {
  std::vector<Pose> poses;
  for (int i = 0; i < 11; ++i) poses.push_back(At(10.0 * i, 0.0, 0.0));
  Stands stands;
  EXPECT_FALSE(stands.IsAnyBeside(poses[0], 2.0));
  for (const Pose& pose : poses) stands.Add(pose);
  for (int i = 0; i < 11; ++i) {
    EXPECT_TRUE(stands.IsAnyBeside(At(10.0 * i, 1.9, 40.0), 2.0)) << i;
    EXPECT_FALSE(stands.IsAnyBeside(At(10.0 * i, 2.1, 0.0), 2.0)) << i;
    EXPECT_FALSE(stands.IsAnyBeside(At(10.0 * i, 0.0, 60.0), 2.0)) << i;
  }
}

}  // namespace
}  // namespace scanloc
