#include "scanloc/core/scan/descriptor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "scanloc/core/map/map.hpp"
#include "support/brute_force.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

Describer MakeDescriber(const Params& params) {
  auto describer = Describer::Create(params);
  EXPECT_TRUE(describer.ok()) << describer.status();
  return *std::move(describer);
}

void ExpectHeights(const Context& context, const std::vector<std::vector<double>>& heights_m) {
  ASSERT_EQ(context.num_rows, static_cast<int>(heights_m.size()));
  ASSERT_EQ(context.num_cols, static_cast<int>(heights_m[0].size()));
  for (int r = 0; r < context.num_rows; ++r) {
    for (int c = 0; c < context.num_cols; ++c) {
      ASSERT_NEAR(context.At(r, c), heights_m[r][c] * 100.0, 0.6) << "row " << r << " col " << c;
    }
  }
}

/// Points no two of which share a voxel, none near a bin's edge, so that references need no voxel
/// filter and no care about rounding.
PointCloud PointsInsideBins(const Params& params, std::uint64_t seed, double root_shift_m) {
  PointCloud points;
  const double ring_m = params.polar.max_range_m / params.polar.num_rings;
  const double sector_rad = 2.0 * std::numbers::pi / params.polar.num_sectors;
  for (const Point& p : scenes::RandomScan(seed, 3'000)) {
    const double range = std::hypot(p.x, p.y - root_shift_m) / ring_m;
    const double azimuth = std::atan2(p.y - root_shift_m, p.x) / sector_rad;
    const auto near_edge = [](double bins) { return std::abs(bins - std::round(bins)) < 1e-3; };
    if (!near_edge(range) && !near_edge(azimuth)) points.push_back(p);
  }
  VoxelFilter filter(params.voxel_size_m);
  return filter.Apply(points);
}

TEST(PolarContext, HoldsTheGreatestHeightOfEachRingAndSector) {
  for (const int num_sectors : {60, 6, 10, 2, 90, 120}) {
    Params params;
    params.polar.num_sectors = num_sectors;
    Describer describer = MakeDescriber(params);
    const PointCloud points = PointsInsideBins(params, 7, 0.0);
    SCOPED_TRACE(num_sectors);
    ExpectHeights(describer.Describe(points).polar,
                  brute_force::PolarHeights_m(points, params, 0.0));
  }
}

TEST(PolarContext, OfAVirtualVehicleIsSeenFromItsPosition) {
  const Params params;
  Describer describer = MakeDescriber(params);
  for (std::size_t v = 0; v < params.polar.root_shifts_m.size(); ++v) {
    const double shift_m = params.polar.root_shifts_m[v];
    const PointCloud points = PointsInsideBins(params, 11, shift_m);
    ExpectHeights(describer.DescribePlace(points).polar.at(v + 1),
                  brute_force::PolarHeights_m(points, params, shift_m));
  }
}

TEST(CartContext, HoldsTheGreatestHeightOfEachCell) {
  const Params params;
  Describer describer = MakeDescriber(params);
  const PointCloud points = PointsInsideBins(params, 13, 0.0);
  ExpectHeights(describer.Describe(points).cart, brute_force::CartHeights_m(points, params));
}

TEST(PolarContext, TurnsByHalfItsSectorsWhenTheVehicleIsReversed) {
  const Params params;
  Describer describer = MakeDescriber(params);
  PointCloud scan = scenes::RandomScan(3, 30'000);
  for (int i = 1; i < 80; ++i) {  // on the edges of bins, too; the origin has no azimuth
    scan.push_back({static_cast<float>(i), 0.0F, 5.0F});
    scan.push_back({0.0F, static_cast<float>(-i), 6.0F});
  }
  const Context forward = describer.Describe(scan).polar;
  const Context reversed = describer.Describe(scenes::Reversed(scan)).polar;
  const std::size_t half = forward.cells_cm.size() / 2;
  Context turned = reversed;
  std::rotate(turned.cells_cm.begin(), turned.cells_cm.begin() + half, turned.cells_cm.end());
  EXPECT_EQ(turned, forward);
}

TEST(CartContext, OfTheReversedVehicleIsExactlyTheDoubleFlip) {
  const Params params;
  Describer describer = MakeDescriber(params);
  PointCloud scan = scenes::RandomScan(3, 30'000);
  for (int i = -100; i <= 100; ++i) {  // on the edges of bins and of the region, too
    scan.push_back({static_cast<float>(i), static_cast<float>(i % 40), 5.0F});
    scan.push_back({0.0F, static_cast<float>(i), 6.0F});
  }
  const PlaceDescriptor forward = describer.DescribePlace(scan);
  const PlaceDescriptor reversed = describer.DescribePlace(scenes::Reversed(scan));
  Map map = MakeEmptyMap(params);
  map.AppendDescriptor(0, forward);
  ASSERT_EQ(map.cart.size(), 2U);
  const ContextView flip = map.cart.context(1);
  EXPECT_TRUE(std::equal(flip.cells_cm.begin(), flip.cells_cm.end(), reversed.cart.cells_cm.begin(),
                         reversed.cart.cells_cm.end()));
  const Keys keys = MakeKeys(reversed.cart);
  EXPECT_TRUE(std::equal(flip.aligning_cm.begin(), flip.aligning_cm.end(), keys.aligning_cm.begin(),
                         keys.aligning_cm.end()));
  EXPECT_EQ(keys.retrieval_cm, map.cart.retrieval_key_cm(1));
}

TEST(Describer, ClampsHeightsBelowGroundAndAboveTheGreatest) {
  const Params params;
  Describer describer = MakeDescriber(params);
  const PointCloud scan = {{10, 10, -50}, {20, 20, 3000}, {-30, 1, 1}};
  const ScanDescriptor descriptor = describer.Describe(scan);
  EXPECT_EQ(std::count(descriptor.cart.cells_cm.begin(), descriptor.cart.cells_cm.end(), 0),
            40 * 40 - 2);
  EXPECT_EQ(*std::max_element(descriptor.cart.cells_cm.begin(), descriptor.cart.cells_cm.end()),
            Context::kMaxHeight_cm);
  EXPECT_EQ(std::count(descriptor.polar.cells_cm.begin(), descriptor.polar.cells_cm.end(), 300), 1);
}

TEST(Describer, AnswersScansWithoutPointsWithZeros) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Params params;
  Describer describer = MakeDescriber(params);
  for (const PointCloud& scan :
       {PointCloud{}, PointCloud{{kNan, kNan, kNan}}, PointCloud{{500, 500, 1}}}) {
    const ScanDescriptor descriptor = describer.Describe(scan);
    EXPECT_EQ(descriptor.num_voxels, 0U);
    EXPECT_TRUE(Validate(descriptor, params).ok());
    EXPECT_EQ(std::count(descriptor.polar.cells_cm.begin(), descriptor.polar.cells_cm.end(), 0),
              20 * 60);
  }
}

TEST(Describer, PutsAPointAtTheOriginIntoTheFirstRing) {
  Describer describer = MakeDescriber(Params{});
  const PointCloud scan = {{0, 0, 1}};
  EXPECT_EQ(describer.Describe(scan).polar.At(0, 0), 300);
}

TEST(Describer, LeavesOutTheKindThatIsNotEnabled) {
  Params params;
  params.cart.enabled = false;
  const PlaceDescriptor place = MakeDescriber(params).DescribePlace(scenes::RandomScan(1, 1000));
  EXPECT_TRUE(place.cart.empty());
  EXPECT_EQ(place.polar.size(), 3U);
  EXPECT_TRUE(Validate(place, params).ok());
}

TEST(Describer, GivesTheSameBitsWhicheverScanCameBefore) {
  const Params params;
  Describer used = MakeDescriber(params);
  (void)used.DescribePlace(scenes::RandomScan(1, 40'000));
  const PointCloud scan = scenes::RandomScan(2, 10'000);
  EXPECT_EQ(used.DescribePlace(scan), MakeDescriber(params).DescribePlace(scan));
}

TEST(ValidateDescriptor, RefusesOtherShapesAndHeights) {
  const Params params;
  Describer describer = MakeDescriber(params);
  const ScanDescriptor good = describer.Describe(scenes::RandomScan(1, 1000));
  EXPECT_TRUE(Validate(good, params).ok());

  ScanDescriptor missing = good;
  missing.cart = {};
  EXPECT_EQ(Validate(missing, params).code(), absl::StatusCode::kInvalidArgument);
  ScanDescriptor turned = good;
  std::swap(turned.polar.num_rows, turned.polar.num_cols);
  EXPECT_FALSE(Validate(turned, params).ok());
  ScanDescriptor cut = good;
  cut.polar.cells_cm.pop_back();
  EXPECT_FALSE(Validate(cut, params).ok());
  ScanDescriptor high = good;
  high.polar.cells_cm[0] = Context::kMaxHeight_cm + 1;
  EXPECT_FALSE(Validate(high, params).ok());

  PlaceDescriptor place = describer.DescribePlace(scenes::RandomScan(1, 1000));
  EXPECT_TRUE(Validate(place, params).ok());
  place.polar.pop_back();
  EXPECT_FALSE(Validate(place, params).ok());
}

TEST(Describer, FindsPostsInVoxelsOfTheirOwnAndLeavesTheContextsAsTheyAre) {
  Params params;
  PointCloud scan = scenes::PostScan(5, 0);
  // A chair, too low to be a post of a town.
  for (int k = 0; k < 10; ++k) scan.push_back({5.1F, 3.1F, -1.95F + 0.06F * static_cast<float>(k)});
  const ScanDescriptor town = MakeDescriber(params).Describe(scan);
  params.automatic = AutoParamsAtScale(0.5);
  const ScanDescriptor room = MakeDescriber(params).Describe(scan);
  EXPECT_EQ(room.polar.cells_cm, town.polar.cells_cm);
  EXPECT_EQ(room.cart.cells_cm, town.cart.cells_cm);
  EXPECT_TRUE(town.structure.posts.empty());
  ASSERT_EQ(room.structure.posts.size(), 1U);
  EXPECT_NEAR(room.structure.posts[0].x_cm, 510, 5);
}

}  // namespace
}  // namespace scanloc
