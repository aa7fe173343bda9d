#include "scanloc/eval/seg_match.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "scanloc/core/scan/pose.hpp"
#include "support/scenes.hpp"

namespace scanloc::eval {
namespace {

void AddBox(const Eigen::Vector3f& corner, const Eigen::Vector3f& size, PointCloud* scan) {
  for (float x = 0.0F; x <= size.x(); x += 0.5F) {
    for (float y = 0.0F; y <= size.y(); y += 0.5F) {
      for (float z = 0.0F; z <= size.z(); z += 0.5F) {
        scan->push_back({corner.x() + x, corner.y() + y, corner.z() + z});
      }
    }
  }
}

/// Flat ground 2 m below the sensor, and boxes of many shapes on it.
PointCloud Scene(unsigned seed) {
  PointCloud scan;
  for (float x = -40.0F; x <= 40.0F; x += 1.0F) {
    for (float y = -40.0F; y <= 40.0F; y += 1.0F) scan.push_back({x, y, -2.0F});
  }
  std::mt19937 random(seed);
  const auto draw = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 8) / static_cast<float>(1 << 24);
  };
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      AddBox({-34.0F + 14.0F * static_cast<float>(i) + draw(0, 4),
              -34.0F + 14.0F * static_cast<float>(j) + draw(0, 4), -2.0F},
             {draw(0.5F, 6), draw(0.5F, 6), draw(1.5F, 8)}, &scan);
    }
  }
  return scan;
}

TEST(SegMatch, DescribesEachSegmentByItsEigenvaluesAndItsCentroid) {
  PointCloud scan;
  for (float x = 0.0F; x <= 30.0F; x += 1.0F) scan.push_back({x, 0.0F, -2.0F});
  for (float z = -2.0F; z <= 6.0F; z += 0.25F) scan.push_back({10.1F, 5.1F, z});  // a pole
  for (float y = -12.0F; y <= -4.0F; y += 0.4F) {
    for (float z = -2.0F; z <= 6.0F; z += 0.4F) scan.push_back({20.1F, y, z});  // a wall
  }
  scan.push_back({std::numeric_limits<float>::quiet_NaN(), 1.0F, 1.0F});
  const Eigen::VectorXf rows = SegMatch().Describe(scan);
  ASSERT_EQ(rows.size(), 2 * SegMatch::kRowLength);
  EXPECT_TRUE(rows.allFinite());
  const bool pole_is_first = rows(7) < 15.0F;
  const auto pole = rows.segment<SegMatch::kRowLength>(pole_is_first ? 0 : SegMatch::kRowLength);
  const auto wall = rows.segment<SegMatch::kRowLength>(pole_is_first ? SegMatch::kRowLength : 0);
  EXPECT_GT(pole(0), 0.95F) << "linearity";
  EXPECT_GT(wall(1), 0.7F) << "planarity; it lost its foot";
  EXPECT_LT(wall(2), 0.05F) << "scattering";
  EXPECT_NEAR(pole(7), 10.1F, 0.1F);
  EXPECT_NEAR(pole(8), 5.1F, 0.1F);
  EXPECT_NEAR(wall(8), -8.0F, 0.3F);
}

TEST(SegMatch, FindsNothingWhereNothingStands) {
  const SegMatch baseline;
  EXPECT_EQ(baseline.Describe({}).size(), 0);
  const PointCloud ground = {{1, 0, -2}, {2, 0, -2}, {3, 0, -2}};
  EXPECT_EQ(baseline.Describe(ground).size(), 0);
}

TEST(SegMatch, RecognisesAPlaceFromAnotherHeadingAndNoneElsewhere) {
  constexpr unsigned kNumPlaces = 6;
  Map map;
  std::vector<Eigen::VectorXf> vectors;
  SegMatch baseline;
  for (unsigned place = 0; place < kNumPlaces; ++place) {
    map.places.push_back({.T_map_place = PlanarOffset(100.0 * place, 0.0)});
    vectors.push_back(baseline.Describe(Scene(place)));
  }
  baseline.Prepare(map, vectors);
  const ScanDescriptor descriptor;
  for (unsigned place = 0; place < kNumPlaces; ++place) {
    const PointCloud scan = scenes::SeenFrom(Scene(place), PlanarOffset(0.0, 1.5707963));
    const Answer answer =
        baseline.Recognize({.scan = scan, .descriptor = descriptor, .num_answers = 3});
    ASSERT_FALSE(answer.candidates.empty()) << place;
    EXPECT_EQ(answer.candidates[0].place, static_cast<std::int32_t>(place));
    EXPECT_LT(answer.candidates[0].distance, 0.15) << "many segments agree";
    std::vector<bool> excluded(kNumPlaces, true);
    const BaselineQuery none{.scan = scan, .descriptor = descriptor, .excluded = &excluded};
    EXPECT_TRUE(baseline.Recognize(none).candidates.empty());
  }
  EXPECT_TRUE(baseline.Recognize({.scan = {}, .descriptor = descriptor}).candidates.empty());
}

}  // namespace
}  // namespace scanloc::eval
