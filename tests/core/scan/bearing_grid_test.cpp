#include "scanloc/core/scan/bearing_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "scanloc/core/scan/pose.hpp"

namespace scanloc {
namespace {

constexpr double kRing_m = 4.0;

std::vector<Post> RandomPosts(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  std::vector<Post> posts;
  for (int i = 0; i < count; ++i) {
    const auto coordinate = [&] {
      return static_cast<std::int16_t>(static_cast<int>(random() % 10'000) - 5'000);
    };
    posts.push_back({coordinate(), coordinate()});
  }
  return posts;
}

/// As a sensor sees them that is headed by so much more to the left.
std::vector<Post> SeenTurned(const std::vector<Post>& posts, double heading_rad) {
  std::vector<Post> seen;
  for (const Post& c : posts) {
    const double cosine = std::cos(-heading_rad);
    const double sine = std::sin(-heading_rad);
    seen.push_back({static_cast<std::int16_t>(std::lround(cosine * c.x_cm - sine * c.y_cm)),
                    static_cast<std::int16_t>(std::lround(sine * c.x_cm + cosine * c.y_cm))});
  }
  return seen;
}

TEST(BearingGrid, RecoversEveryHeadingWithinASector) {
  const std::vector<Post> posts = RandomPosts(1, 150);
  const BearingGrid place = BearingGrid(posts, kRing_m).Widened();
  for (double heading_rad = -3.1; heading_rad < 3.14; heading_rad += 0.07) {
    const std::vector<double> found =
        place.BestHeadings(BearingGrid(SeenTurned(posts, heading_rad), kRing_m), 2);
    ASSERT_FALSE(found.empty());
    EXPECT_LT(std::abs(WrapAngle(found.front() - heading_rad)), 0.1) << heading_rad;
  }
}

TEST(BearingGrid, IsNotMisledByABlindSector) {
  const std::vector<Post> posts = RandomPosts(2, 150);
  const BearingGrid place = BearingGrid(posts, kRing_m).Widened();
  std::vector<Post> seen = SeenTurned(posts, 2.0);
  std::erase_if(seen, [](const Post& c) { return c.x_cm < 0; });
  EXPECT_LT(std::abs(WrapAngle(place.BestHeadings(BearingGrid(seen, kRing_m), 1).front() - 2.0)),
            0.1);
}

TEST(BearingGrid, GivesHeadingsThatAreApartBestFirst) {
  const BearingGrid place = BearingGrid(RandomPosts(3, 200), kRing_m).Widened();
  const BearingGrid query(RandomPosts(4, 200), kRing_m);
  const std::vector<double> headings = place.BestHeadings(query, 5);
  ASSERT_EQ(headings.size(), 5U);
  for (std::size_t i = 0; i < headings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT(std::abs(WrapAngle(headings[i] - headings[j])), 0.25);
    }
  }
}

TEST(BearingGrid, HasNoHeadingForAScanOfNothing) {
  const BearingGrid nothing(std::span<const Post>{}, kRing_m);
  const BearingGrid place = BearingGrid(RandomPosts(5, 50), kRing_m).Widened();
  EXPECT_TRUE(place.BestHeadings(nothing, 3).empty());
  EXPECT_TRUE(nothing.BestHeadings(place, 3).empty());
}

TEST(BearingGrid, CountsWhatAgrees) {
  // One thing ahead, one to the left, both in the ring from 8 m on.
  const BearingGrid place(std::vector<Post>{{1000, 10}, {-10, 1000}}, kRing_m);
  const BearingGrid query(std::vector<Post>{{1000, 10}}, kRing_m);
  EXPECT_EQ(place.num_sectors(), 2);
  EXPECT_EQ(place.Widened().num_sectors(), 6);
  const BearingGrid::Agreement agreement = place.AgreementByTurn(TurnedBearings(query));
  EXPECT_EQ(agreement[0], 1);
  EXPECT_EQ(agreement[16], 1);
  EXPECT_EQ(agreement[8], 0);
  EXPECT_EQ(place.Widened().AgreementByTurn(TurnedBearings(query))[1], 1);
}

}  // namespace
}  // namespace scanloc
