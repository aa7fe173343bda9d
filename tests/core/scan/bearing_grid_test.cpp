#include "scanloc/core/scan/bearing_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
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
  for (double heading_rad = -3.1; heading_rad < 3.14; heading_rad += 0.07) {
    const std::vector<double> found =
        AgreeingHeadings(posts, SeenTurned(posts, heading_rad), kRing_m, 2);
    ASSERT_FALSE(found.empty());
    EXPECT_LT(std::abs(WrapAngle(found.front() - heading_rad)), 0.1) << heading_rad;
  }
}

TEST(BearingGrid, IsNotMisledByABlindSector) {
  const std::vector<Post> posts = RandomPosts(2, 150);
  std::vector<Post> seen = SeenTurned(posts, 2.0);
  std::erase_if(seen, [](const Post& c) { return c.x_cm < 0; });
  EXPECT_LT(std::abs(WrapAngle(AgreeingHeadings(posts, seen, kRing_m, 1).front() - 2.0)), 0.1);
}

TEST(BearingGrid, GivesHeadingsThatAreApartBestFirst) {
  const std::vector<double> headings =
      AgreeingHeadings(RandomPosts(3, 200), RandomPosts(4, 200), kRing_m, 5);
  ASSERT_EQ(headings.size(), 5U);
  for (std::size_t i = 0; i < headings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT(std::abs(WrapAngle(headings[i] - headings[j])), 0.25);
    }
  }
}

TEST(BearingGrid, HasNoHeadingForAScanOfNothing) {
  const std::vector<Post> place = RandomPosts(5, 50);
  EXPECT_TRUE(AgreeingHeadings(place, {}, kRing_m, 3).empty());
  EXPECT_TRUE(AgreeingHeadings({}, place, kRing_m, 3).empty());
}

TEST(BearingGrid, IsAsOfPostsFartherToTheLeft) {
  const std::vector<Post> posts = {{1000, 10}, {-10, 1000}};
  const std::vector<Post> farther = {{1000, 360}, {-10, 1350}};
  EXPECT_EQ(BearingGrid(posts, kRing_m, 3.5), BearingGrid(farther, kRing_m));
}

TEST(BlockCounts, AreOfWhatAgreesAtEachTurn) {
  // Not quite as many grids as fit in a block.
  std::vector<BearingGrid> places;
  BearingBlock block;
  for (std::uint64_t seed = 0; seed + 1 < BearingBlock::kSize; ++seed) {
    places.push_back(BearingGrid(RandomPosts(seed, 40 * static_cast<int>(seed)), kRing_m));
    block.Add(places.back());
  }
  const BearingGrid seen(RandomPosts(99, 300), kRing_m);
  const BearingQuery query(seen);
  EXPECT_EQ(query.ring_counts(), seen.CountByRing());
  const BlockCounts of_block = query.Count(block);
  for (std::size_t i = 0; i < places.size(); ++i) {
    int most = 0;
    int sum = 0;
    for (std::size_t turn = 0; turn < BearingGrid::kNumSectors; ++turn) {
      int count = 0;
      for (std::size_t ring = 0; ring < BearingGrid::kNumRings; ++ring) {
        count += std::popcount(places[i].rings()[ring] &
                               std::rotl(seen.rings()[ring], static_cast<int>(turn)));
      }
      EXPECT_EQ(of_block.Of(i, turn), count) << i << " turned by " << turn;
      most = std::max(most, count);
      sum += count;
    }
    int of_rings = 0;
    for (std::size_t ring = 0; ring < BearingGrid::kNumRings; ++ring) {
      of_rings += places[i].CountByRing()[ring] * seen.CountByRing()[ring];
    }
    EXPECT_EQ(of_rings, sum);
    EXPECT_EQ(of_block.MostOf(i), most);
  }
  std::vector<std::vector<BearingTurn>> best(BearingBlock::kSize);
  of_block.VisitBest(
      3, [&](std::size_t grid, const BearingTurn& turn) { best[grid].push_back(turn); });
  EXPECT_TRUE(best.front().empty());  // of nothing
  EXPECT_TRUE(best.back().empty());
  for (std::size_t i = 1; i < places.size(); ++i) {
    ASSERT_EQ(best[i].size(), 3U);
    EXPECT_EQ(best[i][0].count, of_block.MostOf(i));
    for (std::size_t n = 0; n < best[i].size(); ++n) {
      EXPECT_EQ(of_block.Of(i, best[i][n].sectors), best[i][n].count);
      if (n > 0) {
        EXPECT_LE(best[i][n].count, best[i][n - 1].count);
        EXPECT_FALSE(best[i][n].IsNextTo(best[i][n - 1]));
      }
    }
  }
}

TEST(BlockCounts, TellTheBestOnce) {
  // One thing ahead; in the place also one to the left, both in the ring from 8 m on.
  BearingBlock block;
  block.Add(BearingGrid(std::vector<Post>{{1000, 10}, {-10, 1000}}, kRing_m));
  const BearingQuery query(BearingGrid(std::vector<Post>{{1000, 10}}, kRing_m));
  std::vector<BearingTurn> best;
  query.Count(block).VisitBest(5, [&](std::size_t grid, const BearingTurn& turn) {
    EXPECT_EQ(grid, 0U);
    best.push_back(turn);
  });
  ASSERT_EQ(best.size(), 2U);
  EXPECT_EQ(best[0].sectors, 0U);
  EXPECT_EQ(best[1].sectors, 16U);
  EXPECT_FALSE(best[0].IsNextTo(best[1]));
  EXPECT_TRUE(best[0].IsNextTo({.sectors = 62}));
}

}  // namespace
}  // namespace scanloc
