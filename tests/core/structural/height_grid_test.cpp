#include "structural/height_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "structural/height_kernels.hpp"
#include "structural/horizon.hpp"

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

TEST(HeightKernels, CountTheSame) {
  constexpr int kSide = 40;
  std::mt19937 random(1);
  const auto within = [&](float reach) {
    return reach * (static_cast<float>(random() % 2001) / 1000.0F - 1.0F);
  };
  std::vector<std::uint32_t> cells(kSide * kSide);
  for (std::uint32_t& cell : cells) cell = random() & random() & 0x7FFFFFFFU;
  std::vector<float> reach_squared(Horizon::kNumSectors);
  for (float& reach : reach_squared) reach = static_cast<float>(random() % 600);
  for (const std::size_t num_points : {0U, 8U, 16U, 24U, 1000U}) {
    std::vector<float> x_m(num_points);
    std::vector<float> y_m(num_points);
    std::vector<std::uint32_t> heights(num_points);
    for (std::size_t i = 0; i < num_points; ++i) {
      x_m[i] = within(14.0F);
      y_m[i] = within(14.0F);
      heights[i] = random() & 0x7FFFFFFFU;
    }
    const HeightView view = {.side = kSide,
                             .cosine = 0.6F,
                             .sine = -0.8F,
                             .x_m = within(2.0F),
                             .y_m = within(2.0F),
                             .cells_per_m = 2.0F,
                             .middle = 20.0F,
                             .last = 39.5F,
                             .sensor_height = 3.1F,
                             .lowest_slope = -0.4F,
                             .highest_slope = 0.7F};
    const std::vector<HeightKernel> kernels = HeightKernels();
    const auto count = [&](HeightKernel kernel) {
      return kernel(view, cells.data(), reach_squared.data(), x_m.data(), y_m.data(),
                    heights.data(), num_points);
    };
    const MetCounts expected = count(kernels.back());
    EXPECT_EQ(expected.num_met > 0, num_points > 0);
    for (const HeightKernel kernel : kernels) {
      const MetCounts counts = count(kernel);
      EXPECT_EQ(counts.num_heights, expected.num_heights);
      EXPECT_EQ(counts.num_met, expected.num_met);
    }
  }
}

}  // namespace
}  // namespace scanloc
