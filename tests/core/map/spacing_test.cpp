#include "scanloc/core/map/spacing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace scanloc {
namespace {

using ::testing::ElementsAre;

std::vector<Pose> PosesAt(const std::vector<double>& xs) {
  std::vector<Pose> poses;
  poses.reserve(xs.size());
  for (const double x : xs) poses.emplace_back(Eigen::Translation3d(x, 0, 0));
  return poses;
}

TEST(SelectBySpacing, KeepsTheFirstAndEachThatIsFarEnoughFromTheLastKept) {
  EXPECT_THAT(SelectBySpacing(PosesAt({0, 0.5, 0.9, 1.2, 2.1, 2.3, 5, 5.5}), 1.0),
              ElementsAre(0, 3, 5, 6));
}

TEST(SelectBySpacing, CountsDistanceAndNotTravel) {
  EXPECT_THAT(SelectBySpacing(PosesAt({0, 0.6, 0, 0.6, 1.1}), 1.0), ElementsAre(0, 4));
}

TEST(SelectBySpacing, KeepsOneOfAStandstillWhosePosesShake) {
  std::vector<double> xs;
  for (int i = 0; i < 1000; ++i) xs.push_back(i % 2 == 0 ? -0.1 : 0.1);
  xs.push_back(5.0);
  EXPECT_THAT(SelectBySpacing(PosesAt(xs), 1.0), ElementsAre(0, 1000));
}

TEST(SelectBySpacing, KeepsPlacesThatTheDriveComesBackTo) {
  EXPECT_THAT(SelectBySpacing(PosesAt({0, 1, 2, 1, 0}), 1.0), ElementsAre(0, 1, 2, 3, 4));
}

TEST(SelectBySpacing, KeepsAllWithoutSpacing) {
  EXPECT_THAT(SelectBySpacing(PosesAt({0, 0, 0}), 0.0), ElementsAre(0, 1, 2));
}

TEST(SelectBySpacing, TakesDrivesSpacedEvenlyWithRounding) {
  std::vector<double> xs(100);
  for (int i = 0; i < 100; ++i) xs[i] = 1.5 * i - (i % 2) * 1e-5;
  EXPECT_EQ(SelectBySpacing(PosesAt(xs), 1.5).size(), 100U);
}

TEST(SelectBySpacing, GivesNothingForNothing) { EXPECT_TRUE(SelectBySpacing({}, 1.0).empty()); }

}  // namespace
}  // namespace scanloc
