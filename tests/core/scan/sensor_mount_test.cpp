#include "scanloc/core/scan/sensor_mount.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "scanloc/core/answer.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SensorMount Turned(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& roll_pitch_yaw_deg) {
  return {.T_base_sensor = *MountPose(offset_m, roll_pitch_yaw_deg)};
}

TEST(MountPose, TurnsByRollThenPitchThenYaw) {
  const Pose pose = *MountPose({1.0, 2.0, 3.0}, {90.0, 0.0, 90.0});
  // The sensor's z is turned by the roll to the base's -y, and by the yaw to its x.
  EXPECT_TRUE((pose.linear() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX(), 1e-12));
  EXPECT_TRUE((pose.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-12));
  EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(1.0, 2.0, 3.0)));
}

TEST(MountPose, RefusesWhatIsOutOfRange) {
  EXPECT_TRUE(absl::IsInvalidArgument(MountPose({101.0, 0, 0}, {0, 0, 0}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(MountPose({0, kNan, 0}, {0, 0, 0}).status()));
  const absl::Status status = MountPose({0, 0, 0}, {0, 181.0, 0}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_NE(status.message().find("pitch is 181"), std::string::npos) << status;
}

TEST(SensorMount, RefusesWhatIsOutOfRange) {
  EXPECT_TRUE(Validate(SensorMount{}).ok());
  SensorMount sheared;
  sheared.T_base_sensor.matrix()(0, 1) = 0.5;
  EXPECT_TRUE(absl::IsInvalidArgument(Validate(sheared)));
  for (const double range_m : {-0.1, 100.5, kNan}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(SensorMount{.min_range_m = range_m}))) << range_m;
  }
  for (const Box& box : {Box{{0, 0, 0}, {1, 1, 0}}, Box{{2, 0, 0}, {1, 1, 1}},
                         Box{{kNan, 0, 0}, {1, 1, 1}}, Box{{0, 0, 0}, {1, 1, 1001.0}}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(SensorMount{.self_box = box})));
  }
}

TEST(Seen, IsTheScanItselfWhereThereIsNothingToDo) {
  const PointCloud scan = scenes::RandomScan(1, 100);
  PointCloud buffer;
  EXPECT_EQ(Seen(Turned({1.0, 0.0, 2.0}, {0, 0, 0}), scan, buffer).data(), scan.data());
}

TEST(Seen, TurnsAHangingSensorUpright) {
  PointCloud buffer;
  const PointView seen =
      Seen(Turned({5.0, 0.0, 2.0}, {180.0, 0, 0}), PointCloud{{1.0F, 2.0F, 3.0F}}, buffer);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_NEAR(seen[0].x, 1.0, 1e-6);
  EXPECT_NEAR(seen[0].y, -2.0, 1e-6);
  EXPECT_NEAR(seen[0].z, -3.0, 1e-6);
}

TEST(Seen, LeavesOutWhatIsNearAndWhatIsTheRobotItself) {
  SensorMount mount = Turned({1.0, 0.0, 2.0}, {0, 0, 180.0});
  mount.min_range_m = 0.5;
  mount.self_box = Box{{-2.0, -1.0, 0.0}, {2.0, 1.0, 1.0}};  // in the base frame
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const PointCloud scan = {{0.1F, 0.2F, 0.3F},    // near
                           {2.0F, 0.0F, -1.5F},   // at (-1, 0, 0.5) of the base: within the box
                           {-2.0F, 0.0F, -1.5F},  // at (3, 0, 0.5): ahead of it
                           {2.0F, 0.0F, 1.0F},    // above it
                           {nan, 0.0F, 0.0F}};
  PointCloud buffer;
  const PointView seen = Seen(mount, scan, buffer);
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_NEAR(seen[0].x, 2.0, 1e-6);
  EXPECT_NEAR(seen[1].z, 1.0, 1e-6);
  EXPECT_TRUE(std::isnan(seen[2].x));
}

TEST(SensorMount, TellsBaseAndTurnedFrameFromTheSensor) {
  const SensorMount mount = Turned({1.0, 0.5, 2.0}, {170.0, -20.0, 60.0});
  const Pose T_map_base = *MountPose({7.0, -3.0, 0.5}, {1.0, 2.0, 140.0});
  const Pose T_map_sensor = T_map_base * mount.T_base_sensor;
  EXPECT_TRUE(BaseOfSensor(mount, T_map_sensor).isApprox(T_map_base, 1e-12));
  const Pose T_map_turned = TurnedOfSensor(mount, T_map_sensor);
  EXPECT_TRUE(T_map_turned.translation().isApprox(T_map_sensor.translation()));
  EXPECT_TRUE(T_map_turned.linear().isApprox(T_map_base.linear(), 1e-12));
  Answer answer{.candidates = {Candidate{.T_map_query = T_map_turned}}};
  TellOfBase(mount, answer);
  EXPECT_TRUE(answer.candidates[0].T_map_query.isApprox(T_map_base, 1e-12));

  const Pose T_last_base = *MountPose({2.0, 0.1, 0.0}, {0.0, 0.0, 30.0});
  const Pose moved = TurnedOfSensor(mount, T_map_base * T_last_base * mount.T_base_sensor);
  EXPECT_TRUE((T_map_turned * TurnedStep(mount, T_last_base)).isApprox(moved, 1e-12));
}

}  // namespace
}  // namespace scanloc
