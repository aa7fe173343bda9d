#include "scanloc/sim/world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "scanloc/sim/simulated_drive.hpp"
#include "worlds/scene.hpp"
#include "worlds/walk.hpp"

namespace scanloc::sim {
namespace {

using ::testing::HasSubstr;

std::vector<WorldKind> ScenesOfEveryKind() {
  std::vector<WorldKind> kinds;
  for (const std::string& name : WorldKindNames()) {
    if (name != "town") kinds.push_back(*ParseWorldKind(name));
  }
  return kinds;
}

SceneOptions Options(WorldKind kind, std::uint64_t seed = 1) {
  SceneOptions options{.seed = seed, .length_m = 300.0};
  options.world.kind = kind;
  options.world.num_aisles = 4;
  return options;
}

bool IsSame(const Solid& a, const Solid& b) {
  return a.shape == b.shape && a.center == b.center && a.axis == b.axis &&
         a.half_length_m == b.half_length_m && a.half_width_m == b.half_width_m &&
         a.z_min_m == b.z_min_m && a.z_max_m == b.z_max_m;
}

std::size_t CountKept(const std::vector<Solid>& of, const std::vector<Solid>& in) {
  return static_cast<std::size_t>(std::count_if(of.begin(), of.end(), [&](const Solid& solid) {
    return std::any_of(in.begin(), in.end(),
                       [&](const Solid& other) { return IsSame(solid, other); });
  }));
}

bool Holds(const Solid& solid, const Eigen::Vector3d& point) {
  if (point.z() < solid.z_min_m || point.z() > solid.z_max_m) return false;
  const Eigen::Vector2d offset = point.head<2>() - solid.center;
  if (solid.shape != SolidShape::kBox) return offset.norm() < solid.half_length_m;
  return std::abs(offset.dot(solid.axis)) < solid.half_length_m &&
         std::abs(offset.dot(LeftOf(solid.axis))) < solid.half_width_m;
}

TEST(WorldKind, IsKnownByItsName) {
  for (const std::string& name : WorldKindNames()) {
    ASSERT_TRUE(ParseWorldKind(name).ok());
    EXPECT_EQ(WorldKindName(*ParseWorldKind(name)), name);
  }
  const absl::Status unknown = ParseWorldKind("castle").status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("warehouse"));
}

TEST(Scene, LeavesTheWayFree) {
  for (const WorldKind kind : ScenesOfEveryKind()) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const Scene scene = MakeScene(Options(kind, seed));
      const Walk walk(scene.walk);
      ASSERT_GT(walk.length_m(), 5.0);
      for (double along = 0.0; along < walk.length_m(); along += 0.5) {
        const Eigen::Vector3d breast = walk.At(along) + Eigen::Vector3d(0.0, 0.0, 0.9);
        for (const Solid& solid : scene.solids) {
          ASSERT_FALSE(Holds(solid, breast))
              << WorldKindName(kind) << " " << seed << " at " << along << " m of "
              << walk.length_m() << ": " << breast.transpose();
        }
      }
    }
  }
}

TEST(Scene, HasAFloorUnderTheWay) {
  for (const WorldKind kind : ScenesOfEveryKind()) {
    const Scene scene = MakeScene(Options(kind, 2));
    const Walk walk(scene.walk);
    for (double along = 0.0; along < walk.length_m(); along += 0.5) {
      const Eigen::Vector3d at = walk.At(along);
      double floor_m = scene.ground.Height(at.x(), at.y());
      if (scene.ground.IsRaised(at.x(), at.y())) floor_m += Ground::kKerb_m;
      for (const Solid& solid : scene.solids) {
        // Within a step of the way; low things beside it are no floor.
        const Eigen::Vector3d top(at.x(), at.y(), solid.z_max_m - 1e-6);
        if (std::abs(solid.z_max_m - at.z()) < 0.25 && Holds(solid, top)) {
          floor_m = std::max(floor_m, solid.z_max_m);
        }
      }
      ASSERT_NEAR(floor_m, at.z(), 0.2) << WorldKindName(kind) << " at " << along << " m";
    }
  }
}

TEST(Scene, ChangesBetweenSessionsByTheShareAskedFor) {
  // A warehouse has thousands of boxes.
  SceneOptions options = Options(WorldKind::kWarehouse);
  for (const double share : {0.0, 0.5, 1.0}) {
    options.world.changed_share = share;
    options.session_seed = 1;
    const Scene first = MakeScene(options);
    options.session_seed = 2;
    const Scene second = MakeScene(options);
    const auto is_stock = [](const Solid& solid) { return solid.half_width_m > 0.3; };
    std::vector<Solid> stock;
    std::copy_if(first.solids.begin(), first.solids.end(), std::back_inserter(stock), is_stock);
    ASSERT_GT(stock.size(), 500U);
    const double kept =
        static_cast<double>(CountKept(stock, second.solids)) / static_cast<double>(stock.size());
    EXPECT_NEAR(kept, 1.0 - share, 0.08);
  }
}

TEST(Scene, StandsTheSameOnEveryVisitButForWhatIsLoose) {
  for (const WorldKind kind : ScenesOfEveryKind()) {
    SceneOptions options = Options(kind);
    options.world.changed_share = 1.0;
    const Scene first = MakeScene(options);
    options.session_seed = 2;
    const Scene second = MakeScene(options);
    EXPECT_EQ(first.walk, second.walk) << WorldKindName(kind);
    EXPECT_GE(CountKept(first.solids, second.solids), 5U) << WorldKindName(kind);
    options.seed = 2;
    EXPECT_NE(MakeScene(options).walk, first.walk) << WorldKindName(kind);
  }
}

TEST(Scene, HasAlikeStoreys) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kGarage}) {
    SceneOptions options = Options(kind);
    options.world.num_floors = 4;
    options.world.changed_share = 1.0;
    options.length_m = 1e4;
    const Scene scene = MakeScene(options);
    double highest_m = 0.0;
    for (const Eigen::Vector3d& corner : scene.walk) highest_m = std::max(highest_m, corner.z());
    const double storey_m = highest_m / 3.0;
    const auto of_storey = [&](int storey) {
      std::vector<Solid> solids;
      for (Solid solid : scene.solids) {
        if (std::floor(0.5 * (solid.z_min_m + solid.z_max_m) / storey_m) != storey) continue;
        solid.z_min_m -= storey * storey_m;
        solid.z_max_m -= storey * storey_m;
        solids.push_back(solid);
      }
      return solids;
    };
    const std::vector<Solid> one = of_storey(1);
    const std::vector<Solid> two = of_storey(2);
    std::size_t num_alike = 0;
    for (const Solid& solid : one) {
      num_alike += std::any_of(two.begin(), two.end(), [&](const Solid& other) {
        return (solid.center - other.center).norm() < 1e-9 &&
               std::abs(solid.z_min_m - other.z_min_m) < 1e-9 &&
               std::abs(solid.z_max_m - other.z_max_m) < 1e-9;
      });
    }
    EXPECT_GE(num_alike, 25U) << WorldKindName(kind);
    EXPECT_LT(num_alike, one.size()) << "furniture, cars and people differ";
  }
}

TEST(Walk, RoundsCornersAndStaysLevelOnStairs) {
  const Walk walk({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {10, 14, 3}, {10, 14, 6}});
  EXPECT_DOUBLE_EQ(walk.length_m(), 25.0) << "a lift takes no way";
  EXPECT_EQ(walk.At(15.0), Eigen::Vector3d(10, 5, 0));
  EXPECT_NEAR(walk.Heading(10.0).x(), std::sqrt(0.5), 1e-9);
  EXPECT_EQ(walk.Slope(22.0), 0.0) << "no ramp is as steep";
  EXPECT_EQ(walk.At(25.0).z(), 6.0);
  const Walk lift({{0, 0, 0}, {5, 0, 0}, {5, 0, 3}, {0, 0, 3}});
  EXPECT_EQ(lift.At(4.9).z(), 0.0);
  EXPECT_EQ(lift.At(5.1).z(), 3.0);
  EXPECT_NEAR(lift.Heading(5.0).x(), 1.0, 1e-9) << "as when it was entered";
  EXPECT_NEAR(lift.Heading(9.0).x(), -1.0, 1e-9);
  EXPECT_NEAR(Walk({{0, 0, 0}, {10, 0, 1}}).Slope(5.0), 0.1, 1e-9);
}

/// A drive that is quick to cast.
SimulateOptions Quick(WorldKind kind) {
  SimulateOptions options;
  options.world.kind = kind;
  options.world.num_aisles = 3;
  options.town.length_m = 120.0;
  options.session.spacing_m = 15.0;
  options.session.sensor_height_m = 0.5;
  options.lidar.num_rays = 16;
  options.lidar.num_azimuths = 180;
  return options;
}

TEST(SimulatedWorld, IsSeenFromEveryScan) {
  for (const WorldKind kind : ScenesOfEveryKind()) {
    const absl::StatusOr<SimulatedDrive> drive = SimulatedDrive::Create(Quick(kind));
    ASSERT_TRUE(drive.ok()) << drive.status();
    for (std::size_t i = 0; i < drive->size(); ++i) {
      EXPECT_GT(drive->Scan(i).size(), 500U) << WorldKindName(kind) << " " << i;
    }
  }
}

TEST(SimulatedWorld, IsTheSameFromAnyMount) {
  // Points of a sensor that lies on its side, looks down or hangs lie on the same floor and walls.
  for (const Eigen::Vector3d& mount_deg :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(90, 0, 0), Eigen::Vector3d(0, 90, 0),
        Eigen::Vector3d(180, 0, 0), Eigen::Vector3d(0, 45, 30)}) {
    SimulateOptions options = Quick(WorldKind::kHall);
    options.session.mount_deg = mount_deg;
    options.world.changed_share = 0.0;
    const absl::StatusOr<SimulatedDrive> drive = SimulatedDrive::Create(options);
    ASSERT_TRUE(drive.ok());
    SceneOptions made{options.town.town_seed, options.session.session_seed, options.town.length_m,
                      options.world};
    const Scene scene = MakeScene(made);
    for (const Point& p : drive->Scan(2)) {
      const Eigen::Vector3d in_map = drive->T_map_sensor(2) * Eigen::Vector3d(p.x, p.y, p.z);
      const auto near = [&](Solid solid) {
        solid.half_length_m += 0.1;
        solid.half_width_m += 0.1;
        solid.z_min_m -= 0.1;
        solid.z_max_m += 0.1;
        return Holds(solid, in_map);
      };
      ASSERT_TRUE(std::abs(in_map.z()) < 0.1 ||
                  std::any_of(scene.solids.begin(), scene.solids.end(), near))
          << mount_deg.transpose() << ": " << in_map.transpose();
    }
    EXPECT_GT(drive->Scan(2).size(), 1000U) << mount_deg.transpose();
  }
}

TEST(SimulatedWorld, IsDrivenInPart) {
  SimulateOptions options = Quick(WorldKind::kWarehouse);
  options.session.spacing_m = 1.0;
  const absl::StatusOr<SimulatedDrive> whole = SimulatedDrive::Create(options);
  options.session.from_m = 30.0;
  options.session.to_m = 50.0;
  const absl::StatusOr<SimulatedDrive> part = SimulatedDrive::Create(options);
  ASSERT_TRUE(whole.ok() && part.ok());
  EXPECT_NEAR(static_cast<double>(part->size()), 20.0, 1.0);
  EXPECT_GT(whole->size(), 100U);
  options.session.from_m = 500.0;
  options.session.to_m = 600.0;
  EXPECT_EQ(SimulatedDrive::Create(options).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(SimulatedWorld, RefusesBadOptionsByName) {
  struct Case {
    const char* field;
    std::function<void(SimulateOptions&)> spoil;
  };
  const Case cases[] = {
      {"num_floors", [](auto& o) { o.world.num_floors = 0; }},
      {"num_aisles", [](auto& o) { o.world.num_aisles = 61; }},
      {"changed_share", [](auto& o) { o.world.changed_share = 1.5; }},
      {"mount_deg", [](auto& o) { o.session.mount_deg.y() = 200.0; }},
      {"from_m", [](auto& o) { o.session.from_m = -1.0; }},
      {"to_m", [](auto& o) { o.session.from_m = 9.0, o.session.to_m = 8.0; }},
      {"odometry_noise_percent", [](auto& o) { o.session.odometry_noise_percent = std::nan(""); }},
  };
  for (const Case& c : cases) {
    SimulateOptions options;
    c.spoil(options);
    EXPECT_THAT(std::string(Validate(options).message()), HasSubstr(c.field));
  }
}

}  // namespace
}  // namespace scanloc::sim
