#include "scan/upright.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "support/building.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

const GroundParams kGround;

/// The scan of an upright sensor as a sensor that is mounted so sees it.
PointCloud AsMounted(const PointCloud& upright, const Eigen::Vector3d& roll_pitch_yaw_deg) {
  return scenes::SeenFrom(upright, *MountPose({0, 0, 0}, roll_pitch_yaw_deg));
}

Structure StructureOf(const PointCloud& scan, bool* knows_up) {
  VoxelFilter filter(0.5);
  return StructureFinder(AutoParams(), 2.0).Find(filter.Apply(scan), knows_up);
}

class AnyMount : public testing::TestWithParam<Eigen::Vector3d> {};

TEST_P(AnyMount, IsTakenOutOfTheStructure) {
  const PointCloud upright = scenes::PostScan(3, 120, 30.0F);
  bool knows_up = false;
  const Structure structure = StructureOf(AsMounted(upright, GetParam()), &knows_up);
  ASSERT_TRUE(knows_up);
  EXPECT_TRUE(Validate(structure).ok());
  EXPECT_NEAR(structure.height_m, 2.0, 0.05);
  const Eigen::Vector3d up_of_sensor =
      MountPose({0, 0, 0}, GetParam())->linear().transpose() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d level_up = LevelFromSensor(structure).linear() * up_of_sensor;
  EXPECT_LT(std::acos(std::min(1.0, level_up.z())), 0.01);
  // As many posts as an upright sensor sees, but for those that voxels cut otherwise.
  const double num_upright = static_cast<double>(StructureOf(upright, nullptr).posts.size());
  EXPECT_NEAR(static_cast<double>(structure.posts.size()), num_upright, 0.1 * num_upright);
}

TEST_P(AnyMount, IsTakenOutOfTheAnswer) {
  test::Building street;
  for (int i = 0; i < 4; ++i) {
    street.Add(scenes::PostScan(20 + i, 120, 30.0F), Pose(Eigen::Translation3d(9.0 * i, 0, 0)));
  }
  const auto localizer = street.Open();
  const Pose T_place_query = PlanarOffset(0.4, 0.7) * *MountPose({0, 0, 0}, GetParam());
  const ScanDescriptor scan =
      street.Describe(scenes::SeenFrom(scenes::PostScan(22, 120, 30.0F), T_place_query));
  const Pose truth = street.map->places[2].T_map_place * T_place_query;
  const Answer answer = *localizer->Localize(scan);
  EXPECT_EQ(answer.outcome, Outcome::kLocalized) << answer.reason;
  const Pose off = answer.candidates.at(0).T_map_query.inverse() * truth;
  EXPECT_LT(off.translation().norm(), 0.3);
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 0.02);
}

TEST(ContextsOfAMountedSensor, AreThoseOfItsLevelledFrame) {
  test::Building street;
  for (int i = 0; i < 4; ++i) {
    street.Add(scenes::PostScan(20 + i, 120, 30.0F), Pose(Eigen::Translation3d(9.0 * i, 0, 0)));
  }
  const Eigen::Vector3d hanging(180, 0, 0);
  const ScanDescriptor scan = street.Describe(AsMounted(scenes::PostScan(22, 120, 30.0F), hanging));
  const Answer answer = *street.Open()->Localize(scan, {.method = *ParseMethod("a-pc")});
  EXPECT_EQ(answer.outcome, Outcome::kLocalized) << answer.reason;
  const Pose truth = street.map->places[2].T_map_place * *MountPose({0, 0, 0}, hanging);
  const Pose off = answer.candidates.at(0).T_map_query.inverse() * truth;
  EXPECT_LT(off.translation().norm(), 0.01);
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Upright, AnyMount,
                         testing::Values(Eigen::Vector3d(0, 20, 0), Eigen::Vector3d(0, 45, 0),
                                         Eigen::Vector3d(90, 0, 0), Eigen::Vector3d(-90, 0, 30),
                                         Eigen::Vector3d(0, -90, 0), Eigen::Vector3d(180, 0, 0),
                                         Eigen::Vector3d(150, 20, -70)));

TEST(SearchGround, FindsNoneWhereNoPlaneHasNothingBelow) {
  EXPECT_FALSE(SearchGround(scenes::RandomScan(1, 20'000, 20.0F), kGround, 2.0).has_value());
  EXPECT_FALSE(SearchGround({}, kGround, 2.0).has_value());
  EXPECT_FALSE(SearchGround(PointCloud(100, Point{1, 1, 1}), kGround, 2.0).has_value());
}

TEST(SearchGround, FindsNoneAtAnotherHeightThanStated) {
  const PointCloud scan = AsMounted(scenes::PostScan(3, 120, 30.0F), {0, 45, 0});
  EXPECT_TRUE(SearchGround(scan, kGround, 2.0).has_value());
  EXPECT_FALSE(SearchGround(scan, kGround, 4.0).has_value());
}

TEST(SearchGround, DoesNotChooseBetweenGroundsThatFaceDifferentWays) {
  // A floor and a wall, as large, as far from the sensor, and nothing behind either.
  PointCloud scan;
  for (float a = -12.0F; a <= 12.0F; a += 0.5F) {
    for (float b = -2.0F; b <= 22.0F; b += 0.5F) {
      scan.push_back({a, b, -2.0F});
      scan.push_back({a, -2.0F, b});
    }
  }
  EXPECT_FALSE(SearchGround(scan, kGround, 2.0).has_value());
}

TEST(SearchGround, TakesNoCeilingForTheFloorOfARamp) {
  // As far above as the floor is below, and as large; beside the floor there is another deck.
  PointCloud scan;
  for (float a = -8.0F; a <= 8.0F; a += 0.5F) {
    for (float b = -8.0F; b <= 8.0F; b += 0.5F) {
      scan.push_back({a, b, 1.2F});
      scan.push_back({a, b, b < 5.0F ? -1.2F : -4.0F});
    }
  }
  EXPECT_FALSE(SearchGround(scan, kGround, 1.2).has_value());
}

TEST(Localizer, SaysInsufficientOfAScanThatDoesNotSayWhichWayIsUp) {
  test::Building street;
  street.Add(scenes::PostScan(20, 120, 30.0F), Pose::Identity());
  PointCloud high = scenes::PostScan(20, 120, 30.0F);  // taken from a height that is not the map's
  for (Point& p : high) p.z -= 5.0F;
  const ScanDescriptor scan = street.Describe(AsMounted(high, {0, 45, 0}));
  EXPECT_FALSE(scan.knows_up);
  const Answer answer = *street.Open()->Localize(scan);
  EXPECT_EQ(answer.outcome, Outcome::kInsufficientScan);
  EXPECT_NE(answer.reason.find("which way is up"), std::string::npos) << answer.reason;
}

}  // namespace
}  // namespace scanloc
