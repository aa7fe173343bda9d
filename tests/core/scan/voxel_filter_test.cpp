#include "scanloc/core/scan/voxel_filter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "support/brute_force.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

using testing::FloatNear;

std::vector<std::vector<double>> Sorted(const PointCloud& points) {
  std::vector<std::vector<double>> rows;
  for (const Point& p : points) rows.push_back({p.x, p.y, p.z});
  std::sort(rows.begin(), rows.end());
  return rows;
}

TEST(VoxelFilter, GivesTheCentroidOfEachOccupiedVoxel) {
  for (const double voxel_size_m : {0.25, 0.5, 2.0}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const PointCloud scan = scenes::RandomScan(seed, 20'000, 30.0F);
      VoxelFilter filter(voxel_size_m);
      ScanCounts counts;
      auto found = Sorted(filter.Apply(scan, &counts));
      auto expected = brute_force::VoxelCentroids(scan, voxel_size_m);
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(found.size(), expected.size()) << "seed " << seed;
      EXPECT_EQ(counts.num_voxels, expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_NEAR(found[i][axis], expected[i][axis], 2e-5) << "seed " << seed;
        }
      }
    }
  }
}

TEST(VoxelFilter, DoesNotDriftHoweverManyPointsAVoxelHolds) {
  PointCloud scan;
  for (int i = 0; i < 200'000; ++i) {
    // Two voxels in turn, so that every point is added by itself.
    scan.push_back(
        {i % 2 == 0 ? 60.3F : -60.3F, 60.2F + 1e-3F * static_cast<float>(i % 200), 0.1F});
  }
  VoxelFilter filter(0.5);
  const PointCloud& centroids = filter.Apply(scan);
  ASSERT_EQ(centroids.size(), 2U);
  EXPECT_NEAR(centroids[0].x, 60.3, 1e-5);
  EXPECT_NEAR(centroids[0].y, 60.299, 1e-5);
  EXPECT_NEAR(centroids[1].y, 60.3, 1e-5);
}

TEST(VoxelFilter, GivesTheSameBitsWhenUsedAgain) {
  const PointCloud first = scenes::RandomScan(1, 50'000);
  const PointCloud second = scenes::RandomScan(2, 5'000);
  VoxelFilter used(0.5);
  (void)used.Apply(first);
  VoxelFilter fresh(0.5);
  EXPECT_EQ(used.Apply(second), fresh.Apply(second));
}

TEST(VoxelFilter, MirrorsTheCentroidsOfAReversedScanExactly) {
  PointCloud scan = scenes::RandomScan(5, 10'000);
  for (const float edge : {0.0F, 0.5F, -0.5F, 1.0F, -80.0F}) scan.push_back({edge, -edge, 1.0F});
  VoxelFilter filter(0.5);
  const PointCloud forward = filter.Apply(scan);
  EXPECT_EQ(scenes::Reversed(filter.Apply(scenes::Reversed(scan))), forward);
}

TEST(VoxelFilter, SkipsAndCountsPointsThatAreNotFiniteOrImpossiblyFar) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const PointCloud scan = {{1, 2, 3},     {kNan, 0, 0},  {0, kNan, 0}, {0, 0, -kInf},
                           {1e30F, 0, 0}, {0, -1e6F, 0}, {0, 0, 0}};
  VoxelFilter filter(0.5);
  ScanCounts counts;
  const PointCloud& left = filter.Apply(scan, &counts);
  EXPECT_EQ(left.size(), 2U);
  EXPECT_THAT(left[0].z, FloatNear(3.0F, 1e-6F));
  EXPECT_EQ(
      counts,
      (ScanCounts{.num_points = 7, .num_not_finite = 3, .num_beyond_limit = 2, .num_voxels = 2}));
}

TEST(VoxelFilter, TakesRowsWithNumbersBetweenForThePointsAlone) {
  for (const std::size_t num_points : {1U, 3U, 512U, 1300U}) {
    for (const std::size_t stride : {3U, 4U, 7U}) {
      // To the last byte: what is behind the last z is not there.
      std::vector<float> rows((num_points - 1) * stride + 3, 1e9F);
      PointCloud scan;
      for (std::size_t i = 0; i < num_points; ++i) {
        const auto at = static_cast<float>(i);
        scan.push_back({0.01F * at, -0.02F * at, i == 700 ? NAN : 1.0F});
        std::memcpy(&rows[i * stride], &scan.back(), sizeof(Point));
      }
      VoxelFilter of_points(0.5), of_rows(0.5);
      ScanCounts points_counted, rows_counted;
      EXPECT_EQ(of_rows.ApplyToRows({rows.data(), num_points, stride}, &rows_counted),
                of_points.Apply(scan, &points_counted));
      EXPECT_EQ(rows_counted, points_counted);
    }
  }
}

TEST(VoxelFilter, AnswersAnEmptyScanWithNothing) {
  VoxelFilter filter(0.5);
  ScanCounts counts;
  EXPECT_TRUE(filter.Apply({}, &counts).empty());
  EXPECT_EQ(counts, ScanCounts{});
}

TEST(VoxelFilter, KeepsAllVoxelsWhenItsTableGrows) {
  PointCloud scan;
  for (int i = 0; i < 200'000; ++i) {
    scan.push_back({static_cast<float>(i % 500), static_cast<float>(i / 500), 0.25F});
  }
  VoxelFilter filter(0.5);
  EXPECT_EQ(filter.Apply(scan).size(), scan.size());
  EXPECT_EQ(filter.Apply(scan).size(), scan.size()) << "second use, with the grown table";
}

}  // namespace
}  // namespace scanloc
