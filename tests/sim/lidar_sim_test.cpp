#include "scanloc/sim/lidar_sim.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "scanloc/core/scan/pose.hpp"

namespace scanloc::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

LidarOptions Ideal() {
  LidarOptions options;
  options.num_rays = 16;
  options.num_azimuths = 120;
  options.max_range_m = 30.0;
  options.range_sigma_m = 0.0;
  options.dropout = 0.0;
  return options;
}

Pose MakePose(double x, double y, double z, double yaw_deg, double pitch_deg = 0.0,
              double roll_deg = 0.0) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(pitch_deg * kDegree, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() << x, y, z;
  return pose;
}

Solid Box(double x, double y, double axis_deg, double half_length, double half_width, double low,
          double high) {
  Solid box;
  box.center = {x, y};
  box.axis = {std::cos(axis_deg * kDegree), std::sin(axis_deg * kDegree)};
  box.half_length_m = half_length;
  box.half_width_m = half_width;
  box.z_min_m = low;
  box.z_max_m = high;
  return box;
}

Solid Round(SolidShape shape, double x, double y, double radius, double low, double high) {
  Solid solid = Box(x, y, 0.0, radius, radius, low, high);
  solid.shape = shape;
  return solid;
}

double Range(const Point& p) { return std::hypot(double{p.x}, double{p.y}, double{p.z}); }
double AzimuthDeg(const Point& p) { return std::atan2(p.y, p.x) / kDegree; }
double ElevationDeg(const Point& p) { return std::atan2(p.z, std::hypot(p.x, p.y)) / kDegree; }

// The oracle: walks along the beam in small steps until it is inside something.

bool IsInside(const Solid& solid, const Eigen::Vector3d& p) {
  if (p.z() < solid.z_min_m || p.z() > solid.z_max_m) return false;
  const Eigen::Vector2d offset = p.head<2>() - solid.center;
  const double radius = solid.half_length_m;
  switch (solid.shape) {
    case SolidShape::kBox:
      return std::abs(offset.dot(solid.axis)) <= radius &&
             std::abs(offset.dot(LeftOf(solid.axis))) <= solid.half_width_m;
    case SolidShape::kCylinder:
      return offset.norm() <= radius;
    case SolidShape::kEllipsoid: {
      const double middle = 0.5 * (solid.z_min_m + solid.z_max_m);
      const double half = 0.5 * (solid.z_max_m - solid.z_min_m);
      return std::hypot(offset.norm() / radius, (p.z() - middle) / half) <= 1.0;
    }
  }
  return false;
}

double WalkBeam(const Ground& ground, const std::vector<Solid>& solids, const Pose& pose,
                const Eigen::Vector3d& direction, double max_range_m) {
  constexpr double kStep_m = 0.01;
  const Eigen::Vector3d step = pose.linear() * direction * kStep_m;
  Eigen::Vector3d p = pose.translation();
  for (double range = 0.0; range < max_range_m; range += kStep_m, p += step) {
    const double kerb = ground.IsRaised(p.x(), p.y()) ? Ground::kKerb_m : 0.0;
    if (p.z() <= ground.Height(p.x(), p.y()) + kerb) return range;
    for (const Solid& solid : solids) {
      if (IsInside(solid, p)) return range;
    }
  }
  return std::numeric_limits<double>::infinity();
}

/// Casts a scan, and compares beam by beam with the oracle. A few beams that pass an edge within
/// the oracle's step may differ.
void ExpectLikeOracle(const LidarOptions& options, const Ground& ground,
                      const std::vector<Solid>& solids, const Pose& pose) {
  const PointCloud scan = CastScan(options, ground, solids, pose, 1);
  std::size_t next = 0;
  int num_beams = 0;
  int num_hits = 0;
  int num_different = 0;
  for (int a = 0; a < options.num_azimuths; ++a) {
    for (int r = 0; r < options.num_rays; ++r) {
      const double azimuth = ((a + 0.5) * 360.0 / options.num_azimuths - 180.0) * kDegree;
      const double elevation =
          (options.min_elevation_deg +
           r * (options.max_elevation_deg - options.min_elevation_deg) / (options.num_rays - 1)) *
          kDegree;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      double range = std::numeric_limits<double>::infinity();
      if (next < scan.size()) {
        const Eigen::Vector3d point(scan[next].x, scan[next].y, scan[next].z);
        if (point.normalized().dot(direction) > 1.0 - 1e-8) {
          range = point.norm();
          ++next;
        }
      }
      const double expected = WalkBeam(ground, solids, pose, direction, options.max_range_m);
      ++num_beams;
      num_hits += std::isfinite(expected) ? 1 : 0;
      const bool same = range == expected || std::abs(range - expected) < 0.03 ||
                        std::min(range, expected) > options.max_range_m - 0.03;
      num_different += same ? 0 : 1;
    }
  }
  EXPECT_EQ(next, scan.size()) << "a point lies on no beam";
  EXPECT_GT(num_hits, num_beams / 4);
  EXPECT_LE(num_different, num_beams / 200);
}

std::vector<Solid> Court() {
  return {Box(8.0, 1.0, 20.0, 3.0, 1.5, -1.0, 6.0),
          Box(-9.0, -3.0, 75.0, 6.0, 0.2, -1.0, 1.4),
          Box(2.0, 12.0, -10.0, 9.0, 4.0, -1.0, 9.0),
          Box(0.0, -7.0, 0.0, 2.1, 0.9, 0.2, 0.9),
          Box(-0.4, -7.0, 0.0, 1.2, 0.8, 0.9, 1.5),
          Box(14.0, -9.0, 45.0, 2.0, 2.0, 2.2, 2.8),
          Round(SolidShape::kCylinder, -4.0, 5.0, 0.3, -0.5, 7.0),
          Round(SolidShape::kCylinder, 5.0, -4.0, 0.6, -0.5, 1.2),
          Round(SolidShape::kEllipsoid, -4.0, 5.0, 2.2, 2.5, 6.0),
          Round(SolidShape::kEllipsoid, -12.0, 9.0, 3.0, 2.0, 8.0)};
}

TEST(CastScan, AgreesWithWalkingAlongTheBeams) {
  ExpectLikeOracle(Ideal(), Ground(), Court(), MakePose(0.3, -0.2, 1.8, 33.0));
}

TEST(CastScan, AgreesWithWalkingAlongTheBeamsWhenTilted) {
  ExpectLikeOracle(Ideal(), Ground(), Court(), MakePose(0.3, -0.2, 1.8, -160.0, 4.0, -7.0));
  ExpectLikeOracle(Ideal(), Ground(), Court(), MakePose(1.0, 2.0, 1.8, 80.0, -25.0, 20.0));
}

TEST(CastScan, AgreesWithWalkingAlongTheBeamsInATown) {
  absl::StatusOr<Town> town = MakeTown({11, 60.0});
  ASSERT_TRUE(town.ok());
  LidarOptions options = Ideal();
  options.max_range_m = 20.0;
  const Eigen::Vector2d at = town->route.At(30.0);
  std::vector<Solid> solids;
  for (Solid solid : town->fixed) {
    const double reach = solid.half_length_m + solid.half_width_m;
    if ((solid.center - at).norm() > options.max_range_m + reach) continue;
    solid.penetration_m = 0.0;  // the oracle does not know how deep a beam goes into leaves
    solids.push_back(solid);
  }
  const double z = town->ground.Height(at.x(), at.y()) + 1.8;
  ExpectLikeOracle(options, town->ground, solids, MakePose(at.x(), at.y(), z, 12.0, 1.0, -2.0));
}

TEST(CastScan, GivesTheSameBitsForTheSameArguments) {
  const LidarOptions options;
  const Pose pose = MakePose(0.0, 0.0, 1.8, 10.0, 1.0, 1.0);
  const PointCloud scan = CastScan(options, Ground(), Court(), pose, 5);
  EXPECT_EQ(scan, CastScan(options, Ground(), Court(), pose, 5));
  EXPECT_NE(scan, CastScan(options, Ground(), Court(), pose, 6));
}

TEST(CastScan, GivesNoPointForTheSky) {
  LidarOptions options = Ideal();
  options.max_range_m = 100.0;
  for (const Point& point : CastScan(options, Ground(), {}, MakePose(0, 0, 1.8, 0), 1)) {
    ASSERT_LT(ElevationDeg(point), 0.0);
  }
  options.min_elevation_deg = 1.0;
  EXPECT_TRUE(CastScan(options, Ground(), {}, MakePose(0, 0, 1.8, 0), 1).empty());
}

TEST(CastScan, HonoursTheFieldOfViewCentredForward) {
  LidarOptions options = Ideal();
  options.fov_deg = 90.0;
  const PointCloud scan = CastScan(options, Ground(), {}, MakePose(0, 0, 1.8, 120.0), 1);
  double low = 0.0;
  double high = 0.0;
  for (const Point& point : scan) {
    low = std::min(low, AzimuthDeg(point));
    high = std::max(high, AzimuthDeg(point));
  }
  EXPECT_NEAR(low, -45.0, 3.0);
  EXPECT_NEAR(high, 45.0, 3.0);
  EXPECT_GE(low, -45.0);
  EXPECT_LE(high, 45.0);
}

TEST(CastScan, HasARingForEachRayThatMeetsTheGround) {
  for (const int num_rays : {16, 128}) {
    LidarOptions options = Ideal();
    options.num_rays = num_rays;
    options.min_elevation_deg = -40.0;
    options.max_elevation_deg = -10.0;
    std::vector<double> elevations;
    for (const Point& point : CastScan(options, Ground(), {}, MakePose(0, 0, 1.8, 0), 1)) {
      elevations.push_back(ElevationDeg(point));
    }
    EXPECT_EQ(elevations.size(), static_cast<std::size_t>(num_rays) * options.num_azimuths);
    std::sort(elevations.begin(), elevations.end());
    int num_rings = 1;
    for (std::size_t i = 1; i < elevations.size(); ++i) {
      if (elevations[i] - elevations[i - 1] > 0.1) ++num_rings;
    }
    EXPECT_EQ(num_rings, num_rays);
  }
}

TEST(CastScan, GivesNothingBeyondTheMaximumRange) {
  LidarOptions options;
  options.max_range_m = 12.0;
  options.range_sigma_m = 0.5;
  for (const Point& point : CastScan(options, Ground(), Court(), MakePose(0, 0, 1.8, 0), 1)) {
    ASSERT_LE(Range(point), options.max_range_m + 1e-4);
  }
}

TEST(CastScan, AddsNoiseOfTheAskedSpreadAlongTheBeam) {
  LidarOptions options = Ideal();
  options.num_azimuths = 1000;
  options.min_elevation_deg = -40.0;
  options.max_elevation_deg = -20.0;
  const Pose pose = MakePose(0, 0, 1.8, 0);
  const PointCloud exact = CastScan(options, Ground(), {}, pose, 1);
  options.range_sigma_m = 0.05;
  const PointCloud noisy = CastScan(options, Ground(), {}, pose, 1);
  ASSERT_EQ(exact.size(), noisy.size());
  double sum = 0.0;
  double sum_squares = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double error = Range(noisy[i]) - Range(exact[i]);
    sum += error;
    sum_squares += error * error;
  }
  const auto count = static_cast<double>(exact.size());
  EXPECT_NEAR(sum / count, 0.0, 0.002);
  EXPECT_NEAR(std::sqrt(sum_squares / count), 0.05, 0.002);
}

TEST(CastScan, LosesMoreReturnsFartherAway) {
  LidarOptions options;
  options.num_azimuths = 2000;
  options.range_sigma_m = 0.0;
  options.max_range_m = 50.0;
  const Pose pose = MakePose(0, 0, 1.8, 0);
  const auto lost = [&](double low_deg, double high_deg) {
    options.min_elevation_deg = low_deg;
    options.max_elevation_deg = high_deg;
    options.dropout = 0.02;
    const auto kept = static_cast<double>(CastScan(options, Ground(), {}, pose, 1).size());
    options.dropout = 0.0;
    return 1.0 - kept / static_cast<double>(CastScan(options, Ground(), {}, pose, 1).size());
  };
  EXPECT_NEAR(lost(-40.0, -30.0), 0.02, 0.003);
  EXPECT_NEAR(lost(-2.25, -2.2), 0.02 * (1.0 + 4.0 * 46.4 * 46.4 / 2500.0), 0.006);
}

TEST(CastScan, EndsInFoliageAtRandomDepthsOrPassesIt) {
  LidarOptions options = Ideal();
  options.num_azimuths = 720;
  options.min_elevation_deg = 5.0;
  options.max_elevation_deg = 45.0;
  Solid crown = Round(SolidShape::kEllipsoid, 8.0, 0.0, 2.0, 3.0, 7.0);
  const Pose pose = MakePose(0, 0, 1.8, 0);
  const PointCloud solid = CastScan(options, Ground(), std::vector{crown}, pose, 1);
  crown.penetration_m = 3.0;
  const PointCloud leaves = CastScan(options, Ground(), std::vector{crown}, pose, 1);
  EXPECT_LT(leaves.size(), solid.size());
  EXPECT_GT(leaves.size(), solid.size() / 3);
  for (const Point& point : leaves) {
    const Eigen::Vector3d offset(point.x - 8.0, point.y, point.z + 1.8 - 5.0);
    ASSERT_LE(offset.norm(), 2.0 + 1e-4);
  }
}

TEST(CastScan, SeesThroughASolidAroundTheSensor) {
  const std::vector<Solid> around = {Box(0, 0, 0, 1, 1, 0, 3),
                                     Round(SolidShape::kCylinder, 0, 0, 2, 0, 3),
                                     Round(SolidShape::kEllipsoid, 0, 0, 2, 0, 4)};
  const Pose pose = MakePose(0, 0, 1.8, 0);
  EXPECT_EQ(CastScan(Ideal(), Ground(), around, pose, 1), CastScan(Ideal(), Ground(), {}, pose, 1));
}

TEST(LidarOptions, AreRefusedByTheNameOfTheFirstBadField) {
  struct Case {
    const char* field;
    std::function<void(LidarOptions&)> spoil;
  };
  const double nan = std::nan("");
  const Case cases[] = {
      {"num_rays", [](auto& o) { o.num_rays = 15; }},
      {"num_rays", [](auto& o) { o.num_rays = 129; }},
      {"min_elevation_deg", [](auto& o) { o.min_elevation_deg = -51; }},
      {"max_elevation_deg", [](auto& o) { o.max_elevation_deg = 51; }},
      {"max_elevation_deg", [](auto& o) { o.max_elevation_deg = o.min_elevation_deg; }},
      {"num_azimuths", [](auto& o) { o.num_azimuths = 89; }},
      {"num_azimuths", [](auto& o) { o.num_azimuths = 4097; }},
      {"fov_deg", [](auto& o) { o.fov_deg = 9.9; }},
      {"fov_deg", [](auto& o) { o.fov_deg = 360.1; }},
      {"fov_deg", [nan](auto& o) { o.fov_deg = nan; }},
      {"max_range_m", [](auto& o) { o.max_range_m = 4; }},
      {"range_sigma_m", [](auto& o) { o.range_sigma_m = -0.1; }},
      {"dropout", [](auto& o) { o.dropout = 0.3; }},
  };
  EXPECT_TRUE(Validate(LidarOptions()).ok());
  for (const Case& c : cases) {
    LidarOptions options;
    c.spoil(options);
    const absl::Status status = Validate(options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << c.field;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.field));
  }
}

}  // namespace
}  // namespace scanloc::sim
