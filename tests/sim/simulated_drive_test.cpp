#include "scanloc/sim/simulated_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <thread>
#include <vector>

namespace scanloc::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// Short and coarse, so that the tests stay quick.
SimulateOptions Small() {
  SimulateOptions options;
  options.town = {21, 120.0};
  options.session.spacing_m = 10.0;
  options.lidar.num_rays = 24;
  options.lidar.num_azimuths = 360;
  return options;
}

SimulatedDrive MakeOrDie(const SimulateOptions& options) {
  absl::StatusOr<SimulatedDrive> drive = SimulatedDrive::Create(options);
  EXPECT_TRUE(drive.ok()) << drive.status();
  return *std::move(drive);
}

Eigen::Vector2d Position(const Pose& pose) { return pose.translation().head<2>(); }
Eigen::Vector2d Heading(const Pose& pose) { return pose.linear().col(0).head<2>().normalized(); }

struct OnRoute {
  double along_m;
  double left_m;
  Eigen::Vector2d tangent;
};

OnRoute Project(const Path& route, const Eigen::Vector2d& point) {
  OnRoute best{0.0, 1e9, {}};
  double best_distance = 1e9;
  for (double s = 0.0; s <= route.length_m(); s += 0.05) {
    const Eigen::Vector2d offset = point - route.At(s);
    if (offset.norm() >= best_distance) continue;
    best_distance = offset.norm();
    const Eigen::Vector2d tangent = route.Tangent(s);
    best = {s, offset.dot(LeftOf(tangent)), tangent};
  }
  return best;
}

/// How far a point lies outside the solid [m]; 0 if it is inside.
double Outside(const Solid& solid, const Eigen::Vector3d& point) {
  const Eigen::Vector2d offset = point.head<2>() - solid.center;
  const double vertical = std::max({0.0, solid.z_min_m - point.z(), point.z() - solid.z_max_m});
  if (solid.shape != SolidShape::kBox) {
    return std::hypot(vertical, std::max(0.0, offset.norm() - solid.half_length_m));
  }
  const double along = std::max(0.0, std::abs(offset.dot(solid.axis)) - solid.half_length_m);
  const double across =
      std::max(0.0, std::abs(offset.dot(LeftOf(solid.axis))) - solid.half_width_m);
  return std::hypot(vertical, std::hypot(along, across));
}

/// From the point to the nearest thing of the town that does not change.
double DistanceToTown(const Town& town, const Eigen::Vector3d& point) {
  const double level = town.ground.Height(point.x(), point.y());
  double nearest =
      std::min(std::abs(point.z() - level), std::abs(point.z() - level - Ground::kKerb_m));
  if (point.z() > level && point.z() < level + Ground::kKerb_m) nearest = 0.0;  // a kerb's face
  for (const std::vector<Solid>* solids : {&town.fixed, &town.changeable}) {
    for (const Solid& solid : *solids) nearest = std::min(nearest, Outside(solid, point));
  }
  return nearest;
}

TEST(SimulatedDrive, KeepsToTheRightHandLane) {
  const SimulatedDrive drive = MakeOrDie(Small());
  ASSERT_GE(drive.size(), 11U);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const OnRoute at = Project(drive.town().route, Position(drive.T_map_sensor(i)));
    EXPECT_NEAR(at.left_m, -1.75, 0.45);
    EXPECT_GT(at.tangent.dot(Heading(drive.T_map_sensor(i))), std::cos(6.0 * kDegree));
  }
}

TEST(SimulatedDrive, HasScansAtTheAskedSpacing) {
  SimulateOptions options = Small();
  options.session.spacing_m = 1.5;
  const SimulatedDrive drive = MakeOrDie(options);
  EXPECT_NEAR(static_cast<double>(drive.size()), 80.0, 1.0);
  for (std::size_t i = 1; i < drive.size(); ++i) {
    const double step =
        (drive.T_map_sensor(i).translation() - drive.T_map_sensor(i - 1).translation()).norm();
    EXPECT_NEAR(step, 1.5, 0.5);  // shorter or longer in bends
    EXPECT_GT(drive.stamp_ns(i), drive.stamp_ns(i - 1));
  }
  EXPECT_EQ(drive.stamp_ns(0), 0);
}

TEST(SimulatedDrive, HasAScanHoweverShortTheRoute) {
  SimulateOptions options = Small();
  options.town.length_m = 20.0;
  options.session.spacing_m = 100.0;
  EXPECT_EQ(MakeOrDie(options).size(), 1U);
}

TEST(SimulatedDrive, ShiftsToTheLeftOfTheForwardDirection) {
  const SimulatedDrive straight = MakeOrDie(Small());
  for (const double shift_m : {-3.0, 3.5, 7.0}) {
    SimulateOptions options = Small();
    options.session.lane_shift_m = shift_m;
    const SimulatedDrive shifted = MakeOrDie(options);
    ASSERT_EQ(shifted.size(), straight.size());
    for (std::size_t i = 0; i < shifted.size(); ++i) {
      const Eigen::Vector2d offset =
          Position(shifted.T_map_sensor(i)) - Position(straight.T_map_sensor(i));
      const Eigen::Vector2d left =
          LeftOf(Project(shifted.town().route, Position(straight.T_map_sensor(i))).tangent);
      EXPECT_NEAR(offset.dot(left), shift_m, 0.05);
      EXPECT_NEAR(offset.norm(), std::abs(shift_m), 1e-9);
    }
  }
}

TEST(SimulatedDrive, ReversedTakesTheSamePathBackwards) {
  SimulateOptions options = Small();
  options.session.lane_shift_m = 3.5;
  const SimulatedDrive forward = MakeOrDie(options);
  options.session.reverse = true;
  const SimulatedDrive reversed = MakeOrDie(options);
  ASSERT_EQ(reversed.size(), forward.size());
  for (std::size_t i = 0; i < forward.size(); ++i) {
    const Pose& there = forward.T_map_sensor(i);
    const Pose& back = reversed.T_map_sensor(forward.size() - 1 - i);
    EXPECT_NEAR((there.translation() - back.translation()).norm(), 0.0, 1e-9);
    EXPECT_LT(Heading(there).dot(Heading(back)), -std::cos(8.0 * kDegree));
  }
}

TEST(SimulatedDrive, StandsAtTheSensorHeightAndTiltsNoMoreThanAsked) {
  for (const double tilt_deg : {0.0, 5.0, 30.0}) {
    SimulateOptions options = Small();
    options.session.sensor_height_m = 2.5;
    options.session.spacing_m = 1.0;
    options.session.tilt_deg = tilt_deg;
    const SimulatedDrive drive = MakeOrDie(options);
    double most_deg = 0.0;
    for (std::size_t i = 0; i < drive.size(); ++i) {
      const Pose& pose = drive.T_map_sensor(i);
      const Eigen::Vector2d at = Position(pose);
      EXPECT_NEAR(pose.translation().z() - drive.town().ground.Height(at.x(), at.y()), 2.5, 1e-9);
      EXPECT_NEAR((pose.linear().transpose() * pose.linear() - Eigen::Matrix3d::Identity()).norm(),
                  0.0, 1e-12);
      EXPECT_NEAR(pose.linear().determinant(), 1.0, 1e-12);
      most_deg = std::max(most_deg, std::acos(pose.linear()(2, 2)) / kDegree);
    }
    const double slope_deg = drive.town().ground.max_slope() / kDegree;
    EXPECT_LE(most_deg, std::sqrt(2.0) * (tilt_deg + 0.5) + slope_deg);
    EXPECT_GE(most_deg, 0.9 * tilt_deg);
    EXPECT_GT(most_deg, 0.05) << "no vehicle drives quite level";
  }
}

TEST(SimulatedDrive, HasTrueAndCommonPosesInEverySession) {
  for (const bool other : {false, true}) {
    SimulateOptions options = Small();
    options.session.parked_share = 0.0;
    options.session.moving_per_km = 0.0;
    options.session.session_seed = other ? 2 : 1;
    options.session.reverse = other;
    options.session.lane_shift_m = other ? 3.5 : 0.0;
    options.session.tilt_deg = other ? 8.0 : 0.0;
    const SimulatedDrive drive = MakeOrDie(options);
    for (std::size_t i = 0; i < drive.size(); i += 3) {
      const PointCloud scan = drive.Scan(i);
      ASSERT_GT(scan.size(), 1000U);
      for (std::size_t k = 0; k < scan.size(); k += 29) {
        const Eigen::Vector3d in_map =
            drive.T_map_sensor(i) * Eigen::Vector3d(scan[k].x, scan[k].y, scan[k].z);
        ASSERT_LT(DistanceToTown(drive.town(), in_map), 0.08) << "scan " << i << " point " << k;
      }
    }
  }
}

TEST(SimulatedDrive, HasVehiclesThatOtherSessionsHaveNot) {
  const auto count_vehicle_points = [](const SimulateOptions& options) {
    const SimulatedDrive drive = MakeOrDie(options);
    const PointCloud scan = drive.Scan(3);
    int count = 0;
    for (std::size_t k = 0; k < scan.size(); k += 5) {
      const Eigen::Vector3d in_map =
          drive.T_map_sensor(3) * Eigen::Vector3d(scan[k].x, scan[k].y, scan[k].z);
      if (DistanceToTown(drive.town(), in_map) > 0.15) ++count;
    }
    return count;
  };
  SimulateOptions options = Small();
  const int first = count_vehicle_points(options);
  EXPECT_GT(first, 20);
  options.session.session_seed = 2;
  EXPECT_NE(count_vehicle_points(options), first);
  options.session.parked_share = 0.0;
  options.session.moving_per_km = 0.0;
  EXPECT_EQ(count_vehicle_points(options), 0);
}

TEST(SimulatedDrive, MeetsNothingInItsOwnWay) {
  for (const double shift_m : {-4.0, 0.0, 3.5, 7.5}) {
    SimulateOptions options = Small();
    options.town.length_m = 400.0;
    options.session.lane_shift_m = shift_m;
    options.session.parked_share = 1.0;
    options.session.moving_per_km = 200.0;
    const SimulatedDrive drive = MakeOrDie(options);
    for (std::size_t i = 0; i < drive.size(); ++i) {
      for (const Point& p : drive.Scan(i)) {
        if (p.z >= 0.2F) continue;  // crowns and signs may hang over the street
        ASSERT_GT(std::hypot(p.x, p.y), 0.8) << "shift " << shift_m;
      }
    }
  }
}

TEST(SimulatedDrive, GivesTheSameScansFromAnyThread) {
  const SimulatedDrive drive = MakeOrDie(Small());
  std::vector<PointCloud> alone;
  for (std::size_t i = 0; i < drive.size(); ++i) alone.push_back(drive.Scan(i));
  std::vector<PointCloud> together(drive.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 2; ++t) {
      threads.emplace_back([&drive, &together, t] {
        for (std::size_t i = t; i < drive.size(); i += 2) together[i] = drive.Scan(i);
      });
    }
  }
  EXPECT_EQ(alone, together);
}

/// FNV-1a over the points' bits.
std::uint64_t Fingerprint(const PointCloud& scan) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  for (const Point& point : scan) {
    for (const float value : {point.x, point.y, point.z}) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 0x100000001B3ULL;
    }
  }
  return hash;
}

// The promise to give the same bytes on any machine and with any compiler flags. Whoever changes
// what towns look like changes the numbers; nobody else may.
TEST(SimulatedDrive, GivesTheSameBitsOnAnyMachine) {
  SimulateOptions options = Small();
  options.session.tilt_deg = 3.0;
  const SimulatedDrive drive = MakeOrDie(options);
  EXPECT_EQ(Fingerprint(drive.Scan(0)), 16799534961241476153ULL);
  EXPECT_EQ(Fingerprint(drive.Scan(7)), 7795987537707684145ULL);
}

TEST(SimulateOptions, AreRefusedByTheNameOfTheFirstBadField) {
  struct Case {
    const char* field;
    std::function<void(SimulateOptions&)> spoil;
  };
  const Case cases[] = {
      {"length_m", [](auto& o) { o.town.length_m = 10.0; }},
      {"lane_shift_m", [](auto& o) { o.session.lane_shift_m = 7.6; }},
      {"lane_shift_m", [](auto& o) { o.session.lane_shift_m = -4.1; }},
      {"spacing_m", [](auto& o) { o.session.spacing_m = 0.0; }},
      {"spacing_m", [](auto& o) { o.session.spacing_m = std::nan(""); }},
      {"tilt_deg", [](auto& o) { o.session.tilt_deg = 30.5; }},
      {"tilt_deg", [](auto& o) { o.session.tilt_deg = -1.0; }},
      {"sensor_height_m", [](auto& o) { o.session.sensor_height_m = 0.0; }},
      {"parked_share", [](auto& o) { o.session.parked_share = 1.1; }},
      {"moving_per_km", [](auto& o) { o.session.moving_per_km = -1.0; }},
      {"num_rays", [](auto& o) { o.lidar.num_rays = 8; }},
  };
  EXPECT_TRUE(Validate(SimulateOptions()).ok());
  for (const Case& c : cases) {
    SimulateOptions options;
    c.spoil(options);
    const absl::Status status = SimulatedDrive::Create(options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << c.field;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.field));
  }
}

}  // namespace
}  // namespace scanloc::sim
