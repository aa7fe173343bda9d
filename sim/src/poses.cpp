#include "poses.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "random.hpp"
#include "town/town_traffic.hpp"

namespace scanloc::sim {
namespace {

constexpr double kWobble_m = 0.15;        // standard deviation of the lateral position
constexpr double kWobbleLength_m = 20.0;  // along the route, between independent positions
constexpr double kHeadingJitter_deg = 1.0;
constexpr double kNaturalTilt_deg = 0.2;  // standard deviation, cut off at kMaxNaturalTilt_deg
constexpr double kMaxNaturalTilt_deg = 0.5;
constexpr double kWalkersWobbleLength_m = 5.0;
constexpr double kWalkersWobble = 0.7;  // of a driver's
constexpr double kWalkersJitter_deg = 2.0;

/// How far left of its line the driver is, smooth along the route and within ±0.4 m.
double Wobble(std::uint64_t seed, double along_m, double length_m = kWobbleLength_m) {
  const double knot = std::floor(along_m / length_m);
  const double f = along_m / length_m - knot;
  const auto at = [&](double i) {
    const double bell = BellShaped(Mix(seed, static_cast<std::uint64_t>(i)));
    return std::clamp(kWobble_m * bell, -0.4, 0.4);
  };
  const double blend = f * f * (3.0 - 2.0 * f);
  return at(knot) * (1.0 - blend) + at(knot + 1.0) * blend;
}

/// RotZ(yaw) · RotY(pitch) · RotX(roll), with the yaw given by the heading's unit vector.
Eigen::Matrix3d Attitude(const Eigen::Vector2d& heading, double pitch_rad, double roll_rad) {
  const Eigen::Vector2d p = CosSin(pitch_rad);
  const Eigen::Vector2d r = CosSin(roll_rad);
  const double cy = heading.x();
  const double sy = heading.y();
  Eigen::Matrix3d attitude;
  attitude << cy * p.x(), cy * p.y() * r.y() - sy * r.x(), cy * p.y() * r.x() + sy * r.y(),  //
      sy * p.x(), sy * p.y() * r.y() + cy * r.x(), sy * p.y() * r.x() - cy * r.y(),          //
      -p.y(), p.x() * r.y(), p.x() * r.x();
  return attitude;
}

/// As the sensor is mounted on what drives.
Eigen::Matrix3d Mounted(const Eigen::Matrix3d& attitude, const SessionOptions& options) {
  if (options.mount_deg.isZero()) return attitude;
  const Eigen::Matrix3d mount =
      Attitude(CosSin(Radians(options.mount_deg.z())), Radians(options.mount_deg.y()),
               Radians(options.mount_deg.x()));
  Eigen::Matrix3d mounted;  // by hand: how Eigen orders the sums depends on the instruction set
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      mounted(i, j) = attitude(i, 0) * mount(0, j) + attitude(i, 1) * mount(1, j) +
                      attitude(i, 2) * mount(2, j);
    }
  }
  return mounted;
}

double Tilt_rad(const SessionOptions& options, Random& random) {
  const double natural =
      std::clamp(kNaturalTilt_deg * random.Bell(), -kMaxNaturalTilt_deg, kMaxNaturalTilt_deg);
  return Radians(natural + random.Uniform(-options.tilt_deg, options.tilt_deg));
}

/// The pose of the sensor `along_m` from the beginning of the route.
Pose MakePose(const Town& town, const SessionOptions& options, double along_m, Random random) {
  const std::uint64_t wobble_seed = Mix(options.session_seed, 0x30B);
  const auto driven = [&](double s) {
    const double offset = DrivenOffset(options) + Wobble(wobble_seed, s);
    return Eigen::Vector2d(town.route.At(s) + LeftOf(town.route.Tangent(s)) * offset);
  };
  const Eigen::Vector2d at = driven(along_m);
  const Eigen::Vector2d tangent = town.route.Tangent(along_m);
  const double drift = (Wobble(wobble_seed, along_m + 0.5) - Wobble(wobble_seed, along_m - 0.5));
  // CosSin of the small drift angle, without an arc tangent.
  const double norm = std::sqrt(1.0 + drift * drift);
  Eigen::Vector2d heading = (tangent + LeftOf(tangent) * drift) / norm;
  const Eigen::Vector2d jitter = CosSin(Radians(kHeadingJitter_deg * random.Bell()));
  heading = heading * jitter.x() + LeftOf(heading) * jitter.y();
  if (options.reverse) heading = -heading;

  // The car stands on the road: a rise ahead lifts its nose, one to the left its left side.
  const auto rise = [&](const Eigen::Vector2d& direction) {
    const Eigen::Vector2d ahead = at + direction;
    const Eigen::Vector2d behind = at - direction;
    return 0.5 *
           (town.ground.Height(ahead.x(), ahead.y()) - town.ground.Height(behind.x(), behind.y()));
  };
  const double pitch_rad = Tilt_rad(options, random) - rise(heading);
  const double roll_rad = Tilt_rad(options, random) + rise(LeftOf(heading));

  Pose pose = Pose::Identity();
  pose.linear() = Mounted(Attitude(heading, pitch_rad, roll_rad), options);
  pose.translation() << at.x(), at.y(),
      town.ground.Height(at.x(), at.y()) + options.sensor_height_m;
  return pose;
}

Pose MakePose(const Walk& walk, const SessionOptions& options, double along_m, Random random) {
  const double wobble =
      kWalkersWobble * Wobble(Mix(options.session_seed, 0x30B), along_m, kWalkersWobbleLength_m);
  Eigen::Vector2d heading = walk.Heading(along_m);
  const Eigen::Vector2d left = LeftOf(heading);
  const Eigen::Vector2d jitter = CosSin(Radians(kWalkersJitter_deg * random.Bell()));
  heading = heading * jitter.x() + left * jitter.y();
  double slope = walk.Slope(along_m);
  if (options.reverse) {
    heading = -heading;
    slope = -slope;
  }
  const double pitch_rad = Tilt_rad(options, random) - slope;
  const double roll_rad = Tilt_rad(options, random);
  const Eigen::Vector3d floor = walk.At(along_m);
  const Eigen::Vector2d at = floor.head<2>() + left * (options.lane_shift_m + wobble);
  Pose pose = Pose::Identity();
  pose.linear() = Mounted(Attitude(heading, pitch_rad, roll_rad), options);
  pose.translation() << at.x(), at.y(), floor.z() + options.sensor_height_m;
  return pose;
}

/// The rotation by a small angle about a unit vector.
Eigen::Matrix3d TurnAbout(const Eigen::Vector3d& axis, double angle_rad) {
  const Eigen::Vector2d turn = CosSin(angle_rad);
  Eigen::Matrix3d cross;
  cross << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
  return turn.x() * Eigen::Matrix3d::Identity() + turn.y() * cross +
         (1.0 - turn.x()) * axis * axis.transpose();
}

template <typename Way>
std::vector<Pose> MakePoses(const Way& way, double length_m, const SessionOptions& options) {
  const std::uint64_t seed = Mix(options.session_seed, 0x705E);
  // Sessions do not stop at the same spots.
  const double start = UnitInterval(Mix(seed, 0)) * std::min(options.spacing_m, length_m);
  const double end = options.to_m > 0.0 ? std::min(length_m, options.to_m) : length_m;
  std::vector<double> along;
  for (std::size_t i = 0;; ++i) {
    const double s = start + static_cast<double>(i) * options.spacing_m;
    if (s > end) break;
    if (s >= options.from_m) along.push_back(s);
  }
  if (options.reverse) std::ranges::reverse(along);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < along.size(); ++i) {
    poses.push_back(MakePose(way, options, along[i], Random(Mix(seed, i + 1))));
  }
  return poses;
}

}  // namespace

std::vector<Pose> PosesAlong(const Town& town, const SessionOptions& options) {
  return MakePoses(town, town.route.length_m(), options);
}

std::vector<Pose> PosesAlong(const Walk& walk, const SessionOptions& options) {
  return MakePoses(walk, walk.length_m(), options);
}

std::vector<Pose> Reckon(const std::vector<Pose>& T_map_sensor, double percent,
                         std::uint64_t seed) {
  // After so far, drift of the heading is as bad as that of the scale.
  constexpr double kDriftLength_m = 100.0;
  Random random(Mix(seed, 0x0D0));
  const double share = 0.01 * percent;
  const double scale = 1.0 + share * random.Bell();
  const double bend_rad_m = 2.0 * share / kDriftLength_m * random.Bell();
  const double rise = 0.3 * share * random.Bell();
  std::vector<Pose> reckoned;
  for (std::size_t i = 0; i < T_map_sensor.size(); ++i) {
    if (i == 0) {
      reckoned.push_back(Pose::Identity());
      continue;
    }
    Pose step = T_map_sensor[i - 1].inverse() * T_map_sensor[i];
    const double length_m = step.translation().norm();
    step.translation() *= scale + 0.5 * share * random.Bell();
    // Up, as seen from the sensor, whatever its mount.
    const Eigen::Vector3d up_before = T_map_sensor[i - 1].linear().row(2);
    const Eigen::Vector3d up = T_map_sensor[i].linear().row(2);
    step.translation() += rise * length_m * up_before;
    const double turn_rad =
        bend_rad_m * length_m + 0.02 * share * std::sqrt(length_m) * random.Bell();
    step.linear() = step.linear() * TurnAbout(up, turn_rad);
    reckoned.push_back(reckoned.back() * step);
  }
  return reckoned;
}

}  // namespace scanloc::sim
