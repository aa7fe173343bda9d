#include "structural/height_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace scanloc {
namespace {

constexpr double kSensorHeight_m = 1.75;

/// A wall of posts around the sensor, each with something at these heights, and a mast that shows
/// how steeply the sensor looks up and down.
Structure Ring(double radius_m, std::uint32_t heights, double from_rad = 0.0,
               double to_rad = 6.28) {
  Structure seen{.height_m = static_cast<float>(kSensorHeight_m)};
  for (double azimuth_rad = from_rad; azimuth_rad < to_rad; azimuth_rad += 0.02) {
    seen.posts.push_back({static_cast<std::int16_t>(100.0 * radius_m * std::cos(azimuth_rad)),
                          static_cast<std::int16_t>(100.0 * radius_m * std::sin(azimuth_rad)),
                          heights});
  }
  seen.posts.push_back({600, 0, 0xfff});
  return seen;
}

class HeightGridTest : public testing::Test {
 protected:
  double Overlap(const Structure& points, const Structure& grid, const PlanarPose& pose = {},
                 const Horizon* horizon = nullptr) {
    HeightGrid filled(params_);
    filled.Fill(PlanarPoints(grid.posts), grid.height_m);
    return filled.Overlap(PlanarPoints(points.posts), pose, horizon);
  }

  PostParams params_;
};

TEST_F(HeightGridTest, MeetsWhatStandsInTheSameCellOrTheNext) {
  const Structure low = Ring(20.0, 0b11);
  EXPECT_EQ(Overlap(low, low), 1.0);
  EXPECT_EQ(Overlap(low, low, {0.4, 0.0, 0.0}), 1.0);
  EXPECT_LT(Overlap(low, low, {3.0, 0.0, 0.0}), 0.5);
  EXPECT_EQ(Overlap(low, low, {100.0, 0.0, 0.0}), 0.0);
  EXPECT_EQ(Overlap(Structure{}, low), 0.0);
}

TEST_F(HeightGridTest, TellsHeightsApartAtTheSameSpot) {
  const Structure full = Ring(20.0, 0xff);
  const Structure gap = Ring(20.0, 0b10000001);
  EXPECT_EQ(Overlap(gap, full), 1.0);
  EXPECT_LT(Overlap(full, gap), 0.6);
}

TEST_F(HeightGridTest, HoldsNothingAgainstWhatTheSensorCannotSee) {
  const Structure high = Ring(20.0, 0x7fffffff);
  Structure low = Ring(20.0, 0x3fff);
  EXPECT_LT(Overlap(high, low), 0.6);
  low.posts.back().heights = 0b111;  // the mast is no higher, so nor is what this sensor sees
  EXPECT_GT(Overlap(high, low), 0.95);
}

TEST_F(HeightGridTest, CountsNothingBeyondTheHorizon) {
  const Structure near = Ring(10.0, 0b11);
  Structure both = near;
  for (const Post& post : Ring(40.0, 0b11).posts) both.posts.push_back(post);
  EXPECT_LT(Overlap(both, near), 0.6);
  const Horizon horizon(near.posts, 2.0);
  EXPECT_EQ(Overlap(both, near, {}, &horizon), 1.0);
}

TEST_F(HeightGridTest, SurvivesPostsAtTheEdgeAndBeyond) {
  Structure edge = Ring(20.0, 0xffffffffU);
  for (const std::int16_t end :
       {std::int16_t{-32768}, std::int16_t{-6000}, std::int16_t{5999}, std::int16_t{32767}}) {
    edge.posts.push_back({end, end, 0xffffffffU});
  }
  EXPECT_GT(Overlap(edge, edge), 0.9);
}

}  // namespace
}  // namespace scanloc
