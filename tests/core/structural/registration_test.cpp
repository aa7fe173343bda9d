#include "scanloc/core/structural/registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "structural/horizon.hpp"

namespace scanloc {
namespace {

constexpr double kCutoff_m = 3.0;
const RegistrationParams kSteps;

std::vector<Post> RandomPosts(std::uint64_t seed, int count, int reach_cm = 4000) {
  std::mt19937_64 random(seed);
  std::vector<Post> posts;
  for (int i = 0; i < count; ++i) {
    const auto coordinate = [&] {
      return static_cast<std::int16_t>(static_cast<int>(random() % (2 * reach_cm)) - reach_cm);
    };
    posts.push_back({coordinate(), coordinate()});
  }
  return posts;
}

/// The posts of frame b in frame a.
std::vector<Post> Moved(const std::vector<Post>& posts, const PlanarPose& T_a_b) {
  std::vector<Post> moved;
  for (const Post& c : posts) {
    const double x_m = std::cos(T_a_b.yaw_rad) * c.x_cm / 100.0 -
                       std::sin(T_a_b.yaw_rad) * c.y_cm / 100.0 + T_a_b.x_m;
    const double y_m = std::sin(T_a_b.yaw_rad) * c.x_cm / 100.0 +
                       std::cos(T_a_b.yaw_rad) * c.y_cm / 100.0 + T_a_b.y_m;
    moved.push_back({static_cast<std::int16_t>(std::lround(x_m * 100.0)),
                     static_cast<std::int16_t>(std::lround(y_m * 100.0))});
  }
  return moved;
}

DistanceField FieldOf(const std::vector<Post>& posts, float cell_m) {
  DistanceField field(cell_m, 60.0, kCutoff_m);
  field.Fill(PlanarPoints(posts));
  return field;
}

TEST(Register, RecoversADisplacementAndATurn) {
  const std::vector<Post> query = RandomPosts(1, 150);
  const RegistrationParams params{.num_iterations = 15, .wide_m = 2.0, .narrow_m = 0.5};
  for (const PlanarPose& truth :
       {PlanarPose{1.0, -0.8, 0.05}, PlanarPose{0.0, 1.5, -0.04}, PlanarPose{7.0, -3.0, 3.1}}) {
    const DistanceField place = FieldOf(Moved(query, truth), 0.25F);
    const PlanarPose guess{truth.x_m + 0.7, truth.y_m - 0.6, truth.yaw_rad + 0.03};
    const PlanarPose found = Register(place, PlanarPoints(query), guess, params);
    EXPECT_NEAR(found.x_m, truth.x_m, 0.15);
    EXPECT_NEAR(found.y_m, truth.y_m, 0.15);
    EXPECT_NEAR(std::remainder(found.yaw_rad - truth.yaw_rad, 2.0 * M_PI), 0.0, 0.003);
  }
}

TEST(Register, SettlesWhereThePostsAreWhateverTheCell) {
  for (const std::uint64_t seed : {11, 12, 13, 14, 15}) {
    const std::vector<Post> posts = RandomPosts(seed, 200);
    for (const float cell_m : {0.25F, 0.5F, 1.0F}) {
      const PlanarPose found = Register(FieldOf(posts, cell_m), PlanarPoints(posts),
                                        {0.6, -0.7, 0.02}, {10, 1.5, 0.7, 20});
      EXPECT_LT(std::hypot(found.x_m, found.y_m), 0.1 * cell_m) << seed;
      EXPECT_LT(std::abs(found.yaw_rad), 0.002);
    }
  }
}

TEST(Register, HoldsOutAgainstPostsThatAreGoneAndNew) {
  std::vector<Post> query = RandomPosts(2, 120);
  const PlanarPose truth{0.5, 0.5, 0.02};
  std::vector<Post> place = Moved(query, truth);
  place.resize(80);
  for (const Post& c : RandomPosts(3, 40)) place.push_back(c);
  const PlanarPose found =
      Register(FieldOf(place, 0.25F), PlanarPoints(query), PlanarPose{}, kSteps);
  EXPECT_NEAR(found.x_m, truth.x_m, 0.1);
  EXPECT_NEAR(found.y_m, truth.y_m, 0.1);
}

TEST(Register, LeavesTheGuessWithoutAnythingToGoBy) {
  const PlanarPose guess{1.0, 2.0, 0.3};
  const DistanceField nothing = FieldOf({}, 1.0F);
  for (const std::vector<Post>& posts : {std::vector<Post>(), RandomPosts(4, 20)}) {
    const PlanarPose found = Register(nothing, PlanarPoints(posts), guess, kSteps);
    EXPECT_DOUBLE_EQ(found.x_m, guess.x_m);
    EXPECT_DOUBLE_EQ(found.y_m, guess.y_m);
    EXPECT_NEAR(found.yaw_rad, guess.yaw_rad, 1e-12);
  }
}

TEST(Overlap, IsNearOneOnItselfAndNearNoneElsewhere) {
  const std::vector<Post> posts = RandomPosts(5, 100);
  const DistanceField field = FieldOf(posts, 0.25F);
  const PlanarPoints points(posts);
  EXPECT_GT(Overlap(field, points, {}, 0.5), 0.9);
  EXPECT_LT(Overlap(field, points, {10.0, 0.0, 1.0}, 0.5), 0.1);
  EXPECT_LT(Overlap(field, points, {1.0e6, 0.0, 0.0}, 0.5), 1e-6);
  EXPECT_EQ(Overlap(field, PlanarPoints(), {}, 0.5), 0.0);
}

TEST(DistanceField, HoldsTheDistanceToTheNearestColumn) {
  const std::vector<Post> posts = RandomPosts(6, 30, 6000);
  for (const float cell_m : {0.25F, 0.5F, 1.0F, 2.0F}) {
    const DistanceField field = FieldOf(posts, cell_m);
    for (int row = 1; row + 1 < field.side(); row += 7) {
      for (int column = 1; column + 1 < field.side(); column += 5) {
        const auto metres = [&](int cell) {
          return (static_cast<double>(cell) + 0.5 - field.side() / 2.0) * cell_m;
        };
        double nearest = 1e9;
        for (const Post& c : posts) {
          nearest = std::min(
              nearest, std::hypot(metres(column) - c.x_cm * 0.01, metres(row) - c.y_cm * 0.01));
        }
        const double told =
            field.unit_m() * field.cells()[static_cast<std::size_t>(row * field.side() + column)];
        // Posts count as a sixteenth of a cell off, along x and y. A cell that a post's stamp just
        // misses is at the cut-off already.
        const double off_m = 1e-3 + std::numbers::sqrt2 / 16.0 * cell_m;
        EXPECT_TRUE(std::abs(told - std::min<double>(nearest, kCutoff_m)) < off_m ||
                    (told > kCutoff_m - 1e-6 && nearest > kCutoff_m - cell_m))
            << cell_m << ": " << told << " for " << nearest;
      }
    }
  }
}

TEST(PlanarPoints, AreSpreadEvenlyOverTheColumns) {
  std::vector<Post> posts;
  for (std::int16_t i = 0; i < 1000; ++i) posts.push_back({i, 0});
  const PlanarPoints points(posts, 10);
  ASSERT_EQ(points.size(), 10U);
  EXPECT_EQ(points.x_m().size() % PlanarPoints::kBlock, 0U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_FLOAT_EQ(points.x_m()[i], static_cast<float>(i));
}

TEST(Inverse, UndoesAPose) {
  const PlanarPose pose{1.0, -2.0, 2.5};
  const PlanarPose twice = Inverse(Inverse(pose));
  EXPECT_NEAR(twice.x_m, pose.x_m, 1e-12);
  EXPECT_NEAR(twice.y_m, pose.y_m, 1e-12);
  EXPECT_NEAR(twice.yaw_rad, pose.yaw_rad, 1e-12);
}

TEST(OverlapWithin, LeavesOutWhatLiesBehindOrWhereNothingWasSeen) {
  // A wall 10 m ahead; nothing behind.
  std::vector<Post> wall;
  for (std::int16_t y_cm = -500; y_cm <= 500; y_cm += 50) wall.push_back({1000, y_cm});
  const DistanceField field = FieldOf(wall, 0.25F);
  const auto overlap = [&](const Horizon& horizon, const std::vector<Post>& posts, double yaw_rad) {
    return OverlapWithin(horizon, field, PlanarPoints(posts), {0.0, 0.0, yaw_rad}, 0.5);
  };
  const Horizon horizon(wall, 2.0);
  EXPECT_GT(overlap(horizon, {{1000, 0}}, 0.0), 0.9);
  EXPECT_GT(overlap(horizon, {{1000, 0}, {1500, 0}, {-300, 0}}, 0.0), 0.9);
  EXPECT_NEAR(overlap(horizon, {{1000, 0}, {800, 0}}, 0.0), 0.5, 0.05);
  EXPECT_EQ(overlap(horizon, {{1000, 0}}, std::numbers::pi), 0.0);
  EXPECT_EQ(overlap(Horizon({}, 2.0), {{1000, 0}}, 0.0), 0.0);
}

TEST(SectorFromRear, IsThatOfTheAzimuth) {
  for (int i = 0; i < 3600; ++i) {
    const double azimuth_rad = -std::numbers::pi + (i + 0.5) * 2.0 * std::numbers::pi / 3600;
    EXPECT_EQ(SectorFromRear(static_cast<float>(3.0 * std::cos(azimuth_rad)),
                             static_cast<float>(3.0 * std::sin(azimuth_rad)), 72),
              i / 50);
  }
  EXPECT_EQ(SectorFromRear(0.0F, 0.0F, 72), 36);
}

}  // namespace
}  // namespace scanloc
