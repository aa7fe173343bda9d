#include "scanloc/core/scan/structure.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scanloc/core/scan/voxel_filter.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

Structure FindIn(const PointCloud& scan, double sensor_height_m = 2.0) {
  VoxelFilter filter(0.5);
  return StructureFinder(AutoParams(), sensor_height_m).Find(filter.Apply(scan));
}

/// A sensor that rolls and pitches where it stands.
PointCloud Tilted(const PointCloud& scan, double roll_rad, double pitch_rad) {
  Pose T_old_new = Pose::Identity();
  T_old_new.rotate(Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()));
  T_old_new.rotate(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()));
  return scenes::SeenFrom(scan, T_old_new);
}

/// Share of the posts of `a` that have one of `b` within 0.3 m.
double ShareNear(const Structure& a, const Structure& b) {
  const auto is_near = [](const Post& p, const Post& q) {
    return std::hypot(p.x_cm - q.x_cm, p.y_cm - q.y_cm) < 30.0;
  };
  const auto num_near = std::count_if(a.posts.begin(), a.posts.end(), [&](const Post& p) {
    return std::any_of(b.posts.begin(), b.posts.end(),
                       [&](const Post& q) { return is_near(p, q); });
  });
  return static_cast<double>(num_near) / static_cast<double>(a.posts.size());
}

TEST(StructureFinder, FindsAPostAtEveryPillarAndNoneOnTheGround) {
  PointCloud scan = scenes::PostScan(1, 0);
  EXPECT_TRUE(FindIn(scan).posts.empty());
  for (int k = 0; k <= 12; ++k) scan.push_back({10.1F, -7.2F, -2.0F + 0.3F * k});
  const Structure structure = FindIn(scan);
  ASSERT_EQ(structure.posts.size(), 1U);
  EXPECT_NEAR(structure.posts[0].x_cm, 1010, 15);
  EXPECT_NEAR(structure.posts[0].y_cm, -720, 15);
  EXPECT_NEAR(structure.height_m, 2.0, 0.05);
}

TEST(StructureFinder, LevelsTheScanOfATiltedSensor) {
  const PointCloud scan = scenes::PostScan(2, 80);
  const Structure level = FindIn(scan);
  for (const auto& [roll_rad, pitch_rad] :
       {std::pair(0.0, 0.09), std::pair(-0.09, 0.0), std::pair(0.15, -0.12)}) {
    const Structure tilted = FindIn(Tilted(scan, roll_rad, pitch_rad));
    const Eigen::Matrix3d rotation = LevelFromSensor(tilted).linear();
    const Eigen::Vector3d up = (Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
                                   .inverse() *
                               Eigen::Vector3d::UnitZ();
    EXPECT_NEAR((rotation * up - Eigen::Vector3d::UnitZ()).norm(), 0.0, 0.02)
        << roll_rad << ", " << pitch_rad;
    EXPECT_NEAR(tilted.height_m, 2.0, 0.15);
    EXPECT_GT(ShareNear(level, tilted), 0.9);
  }
}

TEST(StructureFinder, TakesTheSensorForUprightWhereThereIsNoGround) {
  PointCloud scan;
  for (int k = 0; k < 20; ++k) scan.push_back({5.2F, 5.2F, 0.3F * k});
  const Structure structure = FindIn(scan, 1.5);
  EXPECT_EQ(structure.roll_rad, 0.0F);
  EXPECT_EQ(structure.pitch_rad, 0.0F);
  EXPECT_EQ(structure.height_m, 1.5F);
  EXPECT_EQ(structure.posts.size(), 1U);
}

TEST(StructureFinder, KeepsNothingOfTheScanBefore) {
  VoxelFilter filter(0.5);
  StructureFinder finder(AutoParams(), 2.0);
  const PointCloud scan = scenes::PostScan(3, 50);
  const Structure first = finder.Find(filter.Apply(scan));
  EXPECT_TRUE(finder.Find(filter.Apply(PointCloud())).posts.empty());
  (void)finder.Find(filter.Apply(scenes::PostScan(4, 90)));
  EXPECT_EQ(finder.Find(filter.Apply(scan)), first);
}

TEST(StructureFinder, StaysWithinItsBoundsWhateverTheScan) {
  for (const float range_m : {0.01F, 59.99F, 61.0F, 4000.0F}) {
    PointCloud scan = scenes::RandomScan(5, 100'000, range_m);
    for (Point& p : scan) p.z *= 300.0F;
    EXPECT_TRUE(Validate(FindIn(scan)).ok()) << range_m;
  }
}

// The last coordinates inside, whose sums with the reach round up to its end.
TEST(StructureFinder, TakesPointsAtTheVeryEndOfItsGrids) {
  PointCloud scan = scenes::PostScan(6, 40);
  for (const float end_m : {25.0F, 60.0F}) {
    const float last_m = std::nextafter(end_m, 0.0F);
    for (const float x_m : {last_m, -last_m}) {
      for (const float y_m : {last_m, -last_m}) {
        for (const float z_m : {-2.0F, 0.0F}) scan.push_back({x_m, y_m, z_m});
      }
    }
  }
  StructureFinder finder(AutoParams(), 2.0);
  const Structure structure = finder.Find(scan);
  EXPECT_TRUE(Validate(structure).ok());
  EXPECT_EQ(finder.Find(scan), structure);
}

TEST(ValidateStructure, RefusesWhatNoScanGives) {
  const Structure good{.height_m = 2.0F, .posts = {{5999, -5999}}};
  EXPECT_TRUE(Validate(good, 60.0).ok());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Structure> bad(6, good);
  bad[0].roll_rad = nan;
  bad[1].pitch_rad = 1.6F;
  bad[2].height_m = std::numeric_limits<float>::infinity();
  bad[3].posts.push_back({6001, 0});
  bad[4].posts.push_back({0, -32768});
  bad[5].posts.resize(Structure::kMaxPosts + 1);
  for (const Structure& structure : bad) {
    EXPECT_EQ(Validate(structure, 60.0).code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace scanloc
