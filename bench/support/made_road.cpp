#include "support/made_road.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "random.hpp"

namespace scanloc::bench {
namespace {

constexpr double kBlock_m = 12.0;  // of road that things are drawn for together
constexpr double kReach_m = 80.0;
constexpr float kSensorHeight_m = 1.8F;
constexpr int kNumSectors = 720;  // of the horizon behind which nothing is seen

// The road runs east and swings to the sides: the integral of its heading has a closed form nearly
// enough where it swings slowly, and what counts is that it is the same for all.
double SideOf(double along_m) {
  return 120.0 * std::sin(along_m / 400.0) + 15.0 * std::sin(along_m / 97.0 + 1.0);
}
double HeadingOf(double along_m) {
  return std::atan(0.3 * std::cos(along_m / 400.0) + 15.0 / 97.0 * std::cos(along_m / 97.0 + 1.0));
}

}  // namespace

/// An upright piece: a wall from a to b, or something thin where they are the same.
struct MadeRoad::Thing {
  double ax, ay, bx, by;
  double height_m;
};

Pose MadeRoad::PoseAt(double along_m, double left_m, bool reverse) const {
  const double heading = HeadingOf(along_m);
  Pose pose = Pose::Identity();
  pose.translate(Eigen::Vector3d(along_m - left_m * std::sin(heading),
                                 SideOf(along_m) + left_m * std::cos(heading), 0.0));
  pose.rotate(
      Eigen::AngleAxisd(heading + (reverse ? std::numbers::pi : 0.0), Eigen::Vector3d::UnitZ()));
  return pose;
}

void MadeRoad::AppendThings(std::int64_t block, std::uint64_t session,
                            std::vector<Thing>& things) const {
  Random random(seed_ * 0x9E3779B97F4A7C15ULL +
                static_cast<std::uint64_t>(block) * 0xD1B54A32D192ED03ULL);
  Random change(seed_ + session * 0xA0761D6478BD642FULL + static_cast<std::uint64_t>(block));
  const double built = random.Uniform(0.0, 1.0);  // from open land to a street of houses
  for (const double side : {-1.0, 1.0}) {
    const int num_things = static_cast<int>(random.Uniform(3.0, 8.0));
    for (int i = 0; i < num_things; ++i) {
      const double along_m = kBlock_m * (static_cast<double>(block) + random.Uniform(0.0, 1.0));
      const double left_m = side * random.Uniform(5.0, 45.0);
      const bool is_wall = random.Chance(0.3 + 0.5 * built);
      const double length_m = is_wall ? random.Uniform(4.0, 18.0) : 0.0;
      const double height_m = is_wall ? random.Uniform(2.0, 14.0) : random.Uniform(2.5, 9.0);
      const double turn = random.Chance(0.7) ? random.Uniform(-0.1, 0.1)
                                             : random.Uniform(1.2, 1.9);  // most along the road
      double moved_m = 0.0;
      if (session != 0) {
        if (change.Chance(0.15)) continue;
        if (change.Chance(0.1)) moved_m = change.Uniform(-3.0, 3.0);
      }
      const double heading = HeadingOf(along_m);
      const double x = along_m - left_m * std::sin(heading) + moved_m;
      const double y = SideOf(along_m) + left_m * std::cos(heading) + moved_m;
      const double dx = 0.5 * length_m * std::cos(heading + turn);
      const double dy = 0.5 * length_m * std::sin(heading + turn);
      things.push_back({x - dx, y - dy, x + dx, y + dy, height_m});
    }
  }
  if (session == 0) return;
  if (change.Chance(0.5)) {  // somebody parks
    const double along_m = kBlock_m * (static_cast<double>(block) + change.Uniform(0.0, 1.0));
    const double y = SideOf(along_m) + change.Uniform(-4.0, 4.0);
    things.push_back({along_m - 2.0, y, along_m + 2.0, y, 1.6});
  }
}

PointCloud MadeRoad::Scan(const Visit& visit) const {
  const Pose T_map_sensor = PoseAt(visit.along_m, visit.left_m, visit.reverse);
  const Pose T_sensor_map = T_map_sensor.inverse();
  std::vector<Thing> things;
  const auto first = static_cast<std::int64_t>(std::floor((visit.along_m - kReach_m) / kBlock_m));
  const auto last = static_cast<std::int64_t>(std::floor((visit.along_m + kReach_m) / kBlock_m));
  for (std::int64_t block = first; block <= last; ++block) {
    AppendThings(block, visit.session, things);
  }
  struct Piece {
    float x, y, range, height;
  };
  std::vector<Piece> pieces;
  for (const Thing& thing : things) {
    const Eigen::Vector3d a = T_sensor_map * Eigen::Vector3d(thing.ax, thing.ay, 0.0);
    const Eigen::Vector3d b = T_sensor_map * Eigen::Vector3d(thing.bx, thing.by, 0.0);
    constexpr double kStep_m = 0.4;
    const int num_steps = 1 + static_cast<int>((b - a).norm() / kStep_m);
    for (int i = 0; i < num_steps; ++i) {
      const Eigen::Vector3d at = a + (b - a) * (static_cast<double>(i) / num_steps);
      const double range = at.head<2>().norm();
      if (range < 2.0 || range > kReach_m) continue;
      pieces.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()),
                        static_cast<float>(range), static_cast<float>(thing.height_m)});
    }
  }
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& p, const Piece& q) { return p.range < q.range; });
  PointCloud scan;
  std::array<float, kNumSectors> horizon;  // the slope above which something is seen
  horizon.fill(-1.0F);
  constexpr auto kSectorsPerRad = static_cast<float>(kNumSectors / (2.0 * std::numbers::pi));
  for (const Piece& piece : pieces) {
    const float azimuth = std::atan2(piece.y, piece.x) + static_cast<float>(std::numbers::pi);
    const auto sector =
        std::min<std::size_t>(kNumSectors - 1, static_cast<std::size_t>(azimuth * kSectorsPerRad));
    const float top = piece.height - kSensorHeight_m;
    const float seen_from = std::max(-kSensorHeight_m + 0.2F, horizon[sector] * piece.range);
    for (float z = top; z >= seen_from; z -= 0.7F) scan.push_back({piece.x, piece.y, z});
    horizon[sector] = std::max(horizon[sector], top / piece.range);
  }
  Random noise(visit.session * 31 + static_cast<std::uint64_t>(visit.along_m * 8.0));
  for (float x = -20.0F; x <= 20.0F; x += 1.5F) {
    for (float y = -20.0F; y <= 20.0F; y += 1.5F) {
      scan.push_back({x, y, static_cast<float>(-kSensorHeight_m + noise.Uniform(-0.03, 0.03))});
    }
  }
  return scan;
}

}  // namespace scanloc::bench
