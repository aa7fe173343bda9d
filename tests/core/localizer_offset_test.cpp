#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>

#include "scanloc/core/localizer.hpp"
#include "support/same_answer.hpp"
#include "support/scenes.hpp"

// How far a query is turned or shifted against the place, to the sector and the column.

namespace scanloc {
namespace {

constexpr double kPi = std::numbers::pi;

/// Turns a scan by whole sectors without moving a point across the edge of a voxel's bin: the test
/// scans keep each point in a voxel of its own.
PointCloud SparseScan(std::uint64_t seed, const Params& params) {
  PointCloud scan;
  const double sector_rad = 2.0 * kPi / params.polar.num_sectors;
  const double ring_m = params.polar.max_range_m / params.polar.num_rings;
  std::uint64_t state = seed;
  for (int i = 0; i < 300; ++i) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const double azimuth_rad = (static_cast<double>((state >> 33) % 60) + 0.5) * sector_rad;
    const double range_m = (static_cast<double>((state >> 40) % 19) + 1.5) * ring_m;
    const double z_m = static_cast<double>((state >> 50) % 100) * 0.1;
    scan.push_back({static_cast<float>(range_m * std::cos(azimuth_rad)),
                    static_cast<float>(range_m * std::sin(azimuth_rad)), static_cast<float>(z_m)});
  }
  return scan;
}

std::shared_ptr<const Localizer> OfOnePlace(const Params& params, const PointCloud& scan,
                                            const Pose& T_map_place) {
  auto map = std::make_shared<Map>(MakeEmptyMap(params));
  map->sessions = {"s"};
  map->AppendDescriptor(0, Describer::Create(params)->DescribePlace(scan));
  map->places.push_back({T_map_place, 0, 0});
  return *Localizer::Create(std::move(map));
}

TEST(LocalizerOfOnePlace, RecoversEveryTurnOfAWholeSector) {
  Params params;
  params.search.min_voxels = 10;
  auto describer = *Describer::Create(params);
  const PointCloud place_scan = SparseScan(1, params);
  Pose T_map_place = Pose::Identity();
  T_map_place.translate(Eigen::Vector3d(10, 20, 0));
  T_map_place.rotate(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()));
  const auto localizer = OfOnePlace(params, place_scan, T_map_place);

  for (const char* method : {"pc", "a-pc", "pc-naive", "a-pc-naive-brute"}) {
    for (int sector = 0; sector < 60; ++sector) {
      const Pose T_place_query = PlanarOffset(0.0, sector * 2.0 * kPi / 60);
      Query options;
      options.method = *ParseMethod(method);
      const auto answer = localizer->Localize(
          describer.Describe(scenes::SeenFrom(place_scan, T_place_query)), options);
      ASSERT_TRUE(answer.ok()) << answer.status();
      ASSERT_EQ(answer->candidates.size(), 1U);
      const Candidate& best = answer->candidates[0];
      EXPECT_EQ(answer->outcome, Outcome::kLocalized);
      EXPECT_NEAR(WrapAngle(best.yaw_rad - sector * 2.0 * kPi / 60), 0.0, 1e-9);
      EXPECT_GT(best.yaw_rad, -kPi);
      EXPECT_LE(best.yaw_rad, kPi);
      EXPECT_EQ(best.lateral_m, 0.0);
      test::ExpectPoseNear(best.T_map_query, T_map_place * T_place_query);
    }
  }
}

TEST(LocalizerOfOnePlace, RecoversEveryShiftOfAWholeColumnAheadAndReversed) {
  Params params;
  params.search.min_voxels = 10;
  for (const ShiftMode mode : {ShiftMode::kCircular, ShiftMode::kBounded}) {
    params.cart.shift_mode = mode;
    auto describer = *Describer::Create(params);
    // Points in the middle of cells, within ±18 m so that none leaves the region when shifted.
    PointCloud place_scan;
    for (const Point& p : scenes::RandomScan(9, 600, 99.0F)) {
      place_scan.push_back({std::floor(p.x / 5.0F) * 5.0F + 2.5F,
                            std::floor(p.y * 0.18F / 2.0F) * 2.0F + 1.0F, p.z});
    }
    const Pose T_map_place = PlanarOffset(3.0, 0.5);
    const auto localizer = OfOnePlace(params, place_scan, T_map_place);
    for (int col = -10; col <= 10; ++col) {
      for (const double yaw_rad : {0.0, kPi}) {
        const Pose T_place_query = PlanarOffset(2.0 * col, yaw_rad);
        Query options;
        options.method = *ParseMethod("a-cc");
        const auto answer = localizer->Localize(
            describer.Describe(scenes::SeenFrom(place_scan, T_place_query)), options);
        ASSERT_TRUE(answer.ok()) << answer.status();
        const Candidate& best = answer->candidates.at(0);
        EXPECT_DOUBLE_EQ(best.lateral_m, 2.0 * col) << "yaw " << yaw_rad;
        EXPECT_DOUBLE_EQ(best.yaw_rad, yaw_rad) << "col " << col;
        test::ExpectPoseNear(best.T_map_query, T_map_place * T_place_query);
      }
    }
  }
}

TEST(LocalizerOfOnePlace, TellsABoundedShiftOfMoreThanHalfTheColumns) {
  Params params;
  params.search.min_voxels = 10;
  params.cart.shift_mode = ShiftMode::kBounded;
  params.cart.max_shift_cols = 39;
  auto describer = *Describer::Create(params);
  for (const float side : {1.0F, -1.0F}) {
    // Points in the middle of cells, at 21 to 37 m on one side.
    PointCloud place_scan;
    for (const Point& p : scenes::RandomScan(9, 600, 99.0F)) {
      place_scan.push_back({std::floor(p.x / 5.0F) * 5.0F + 2.5F,
                            side * (std::floor(std::abs(p.y) * 0.09F) * 2.0F + 21.0F), p.z});
    }
    const auto answer =
        OfOnePlace(params, place_scan, Pose::Identity())
            ->Localize(
                describer.Describe(scenes::SeenFrom(place_scan, PlanarOffset(side * 44.0F, 0.0))),
                {.method = *ParseMethod("cc")});
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_DOUBLE_EQ(answer->candidates.at(0).lateral_m, side * 44.0);
  }
}

}  // namespace
}  // namespace scanloc
