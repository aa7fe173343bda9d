#include "scanloc/sim/town.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanloc::sim {
namespace {

using ::testing::HasSubstr;

Town MakeOrDie(std::uint64_t seed, double length_m) {
  absl::StatusOr<Town> town = MakeTown({seed, length_m});
  EXPECT_TRUE(town.ok()) << town.status();
  return *std::move(town);
}

bool Same(const Solid& a, const Solid& b) {
  return a.shape == b.shape && a.center == b.center && a.axis == b.axis &&
         a.half_length_m == b.half_length_m && a.half_width_m == b.half_width_m &&
         a.z_min_m == b.z_min_m && a.z_max_m == b.z_max_m && a.penetration_m == b.penetration_m;
}

/// From the solid's footprint to the point [m].
double Distance(const Solid& solid, const Eigen::Vector2d& point) {
  const Eigen::Vector2d offset = point - solid.center;
  if (solid.shape != SolidShape::kBox) return std::max(0.0, offset.norm() - solid.half_length_m);
  const Eigen::Vector2d left(-solid.axis.y(), solid.axis.x());
  const double along = std::max(0.0, std::abs(offset.dot(solid.axis)) - solid.half_length_m);
  const double across = std::max(0.0, std::abs(offset.dot(left)) - solid.half_width_m);
  return std::hypot(along, across);
}

TEST(Town, IsTheSameForTheSameSeed) {
  const Town a = MakeOrDie(7, 400);
  const Town b = MakeOrDie(7, 400);
  EXPECT_EQ(a.route.points(), b.route.points());
  EXPECT_TRUE(std::equal(a.fixed.begin(), a.fixed.end(), b.fixed.begin(), b.fixed.end(), Same));
  EXPECT_TRUE(std::equal(a.changeable.begin(), a.changeable.end(), b.changeable.begin(),
                         b.changeable.end(), Same));
  EXPECT_EQ(a.parking.size(), b.parking.size());
}

TEST(Town, IsAnotherForAnotherSeed) {
  EXPECT_NE(MakeOrDie(7, 400).route.points(), MakeOrDie(8, 400).route.points());
}

TEST(Town, HasARouteOfTheLengthAsked) {
  for (const double length_m : {20.0, 333.3, 3000.0}) {
    EXPECT_NEAR(MakeOrDie(1, length_m).route.length_m(), length_m, 0.1);
  }
}

TEST(Town, HasARouteWhoseBendsAllowEveryLaneShift) {
  constexpr double kLeastRadius_m = 6.2;  // the leftmost lane lies 5.75 m left of the centre line
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Path route = MakeOrDie(seed, 3000).route;
    for (double s = 1.0; s < route.length_m(); s += 0.5) {
      const Eigen::Vector2d before = route.Tangent(s - 0.5);
      const Eigen::Vector2d after = route.Tangent(s + 0.5);
      const double turn =
          std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
      ASSERT_LT(std::abs(turn), 1.0 / kLeastRadius_m)
          << "town seed " << seed << " at " << s << " m";
    }
  }
}

TEST(Town, TakesHardlyAnyStreetTwice) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Path route = MakeOrDie(seed, 3000).route;
    double repeated_m = 0.0;
    for (double s = 50.0; s < route.length_m(); s += 5.0) {
      bool repeated = false;
      for (double earlier = 0.0; earlier < s - 50.0 && !repeated; earlier += 2.5) {
        const bool near = (route.At(s) - route.At(earlier)).norm() < 3.0;
        repeated = near && std::abs(route.Tangent(s).dot(route.Tangent(earlier))) > 0.9;
      }
      if (repeated) repeated_m += 5.0;
    }
    EXPECT_LT(repeated_m, 0.12 * route.length_m()) << "town seed " << seed;
  }
}

TEST(Town, LeavesEveryLaneOfTheRouteFree) {
  const Town town = MakeOrDie(5, 1500);
  for (const std::vector<Solid>* solids : {&town.fixed, &town.changeable}) {
    for (const Solid& solid : *solids) {
      if (solid.shape == SolidShape::kEllipsoid) continue;  // crowns hang over the street
      for (double s = 0.0; s < town.route.length_m(); s += 2.0) {
        const Eigen::Vector2d point = town.route.At(s);
        if ((point - solid.center).norm() > 60.0) continue;
        ASSERT_GT(Distance(solid, point), 6.4) << "at " << s << " m";
      }
    }
  }
}

TEST(Town, HasLowAndTallBuildingsTreesPolesAndParking) {
  const Town town = MakeOrDie(2, 2000);
  const auto count = [&town](SolidShape shape, double low_m, double high_m) {
    return std::count_if(town.fixed.begin(), town.fixed.end(), [&](const Solid& solid) {
      const double height_m =
          solid.z_max_m - town.ground.Height(solid.center.x(), solid.center.y());
      return solid.shape == shape && height_m > low_m && height_m < high_m &&
             solid.half_length_m * solid.half_width_m > (shape == SolidShape::kBox ? 6.0 : 0.0);
    });
  };
  EXPECT_GT(count(SolidShape::kBox, 2.0, 7.0), 100);
  EXPECT_GT(count(SolidShape::kBox, 9.0, 18.0), 100);
  EXPECT_GT(count(SolidShape::kBox, 20.0, 45.0), 10);
  EXPECT_GT(count(SolidShape::kCylinder, 2.0, 12.0), 300);
  EXPECT_GT(count(SolidShape::kEllipsoid, 4.0, 20.0), 200);
  EXPECT_GT(town.changeable.size(), 50U);
  EXPECT_GT(town.parking.size(), 300U);
}

TEST(Town, RaisesEverythingButTheStreetsByAKerb) {
  const Town town = MakeOrDie(4, 300);
  for (const Street& street : town.streets) {
    const double middle = 0.5 * street.center.length_m();
    const Eigen::Vector2d left = LeftOf(street.center.Tangent(middle));
    const Eigen::Vector2d on = street.center.At(middle) + left * (street.kerb_half_m - 0.8);
    const Eigen::Vector2d off = street.center.At(middle) + left * (street.kerb_half_m + 0.8);
    EXPECT_FALSE(town.ground.IsRaised(on.x(), on.y()));
    EXPECT_TRUE(town.ground.IsRaised(off.x(), off.y()));
  }
}

TEST(Ground, IsNowhereSteeperThanItSays) {
  const Ground ground = MakeOrDie(6, 500).ground;
  EXPECT_GT(ground.max_slope(), 0.0);
  EXPECT_LT(ground.max_slope(), 0.15);
  for (double x = -150.0; x < 150.0; x += 3.7) {
    for (double y = -150.0; y < 150.0; y += 3.7) {
      const double rise_x = ground.Height(x + 0.1, y) - ground.Height(x, y);
      const double rise_y = ground.Height(x, y + 0.1) - ground.Height(x, y);
      ASSERT_LE(std::hypot(rise_x, rise_y), 0.1 * ground.max_slope() + 1e-9);
    }
  }
}

TEST(Ground, IsFlatAndWithoutKerbsByDefault) {
  const Ground ground;
  EXPECT_EQ(ground.Height(123.0, -45.0), 0.0);
  EXPECT_FALSE(ground.IsRaised(123.0, -45.0));
}

TEST(Path, HasPointsAtEqualDistancesAndEndsWhereThePolylineEnds) {
  const Path path({{0.0, 0.0}, {10.0, 0.0}, {10.0, 5.2}});
  EXPECT_NEAR(path.length_m(), 15.2, 1e-12);
  EXPECT_NEAR((path.At(12.0) - Eigen::Vector2d(10.0, 2.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.At(99.0) - Eigen::Vector2d(10.0, 5.2)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.At(-1.0) - Eigen::Vector2d(0.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.Tangent(4.0) - Eigen::Vector2d(1.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((path.Tangent(15.2) - Eigen::Vector2d(0.0, 1.0)).norm(), 0.0, 1e-12);
}

TEST(MakeTown, RefusesLengthsOutOfRange) {
  for (const double length_m :
       {-1.0, 0.0, 19.9, 100'000.5, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const absl::StatusOr<Town> town = MakeTown({1, length_m});
    EXPECT_EQ(town.status().code(), absl::StatusCode::kInvalidArgument) << length_m;
    EXPECT_THAT(std::string(town.status().message()), HasSubstr("length_m"));
  }
}

}  // namespace
}  // namespace scanloc::sim
