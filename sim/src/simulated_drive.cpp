#include "scanloc/sim/simulated_drive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "sim_text.hpp"
#include "town_index.hpp"
#include "town_random.hpp"
#include "town_traffic.hpp"

namespace scanloc::sim {
namespace {

constexpr double kSpeed_mps = 8.0;
constexpr double kWobble_m = 0.15;        // standard deviation of the lateral position
constexpr double kWobbleLength_m = 20.0;  // along the route, between independent positions
constexpr double kHeadingJitter_deg = 1.0;
constexpr double kNaturalTilt_deg = 0.2;  // standard deviation, cut off at kMaxNaturalTilt_deg
constexpr double kMaxNaturalTilt_deg = 0.5;

/// How far left of its line the driver is, smooth along the route and within ±0.4 m.
double Wobble(std::uint64_t seed, double along_m) {
  const double knot = std::floor(along_m / kWobbleLength_m);
  const double f = along_m / kWobbleLength_m - knot;
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
  const auto tilt_rad = [&] {
    const double natural =
        std::clamp(kNaturalTilt_deg * random.Bell(), -kMaxNaturalTilt_deg, kMaxNaturalTilt_deg);
    return Radians(natural + random.Uniform(-options.tilt_deg, options.tilt_deg));
  };
  const double pitch_rad = tilt_rad() - rise(heading);
  const double roll_rad = tilt_rad() + rise(LeftOf(heading));

  Pose pose = Pose::Identity();
  pose.linear() = Attitude(heading, pitch_rad, roll_rad);
  pose.translation() << at.x(), at.y(),
      town.ground.Height(at.x(), at.y()) + options.sensor_height_m;
  return pose;
}

std::vector<Pose> MakePoses(const Town& town, const SessionOptions& options) {
  const std::uint64_t seed = Mix(options.session_seed, 0x705E);
  const double length = town.route.length_m();
  // Sessions do not stop at the same spots.
  const double start = UnitInterval(Mix(seed, 0)) * std::min(options.spacing_m, length);
  std::vector<double> along;
  for (std::size_t i = 0;; ++i) {
    const double s = start + static_cast<double>(i) * options.spacing_m;
    if (s > length) break;
    along.push_back(s);
  }
  if (options.reverse) std::reverse(along.begin(), along.end());
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < along.size(); ++i) {
    poses.push_back(MakePose(town, options, along[i], Random(Mix(seed, i + 1))));
  }
  return poses;
}

}  // namespace

struct SimulatedDrive::State {
  State(const SimulateOptions& simulate, Town made)
      : options(simulate),
        town(std::move(made)),
        poses(MakePoses(town, options.session)),
        fixed(town.fixed),
        standing(MakeStandingTraffic(town, options.session)),
        moving(town, options.session) {}

  SimulateOptions options;
  Town town;
  std::vector<Pose> poses;
  SolidIndex fixed;
  SolidIndex standing;
  MovingTraffic moving;
};

absl::Status Validate(const SessionOptions& options) {
  if (auto s = CheckRange("lane_shift_m", options.lane_shift_m, -4, 7.5); !s.ok()) return s;
  if (auto s = CheckRange("spacing_m", options.spacing_m, 0.1, 100); !s.ok()) return s;
  if (auto s = CheckRange("tilt_deg", options.tilt_deg, 0, 30); !s.ok()) return s;
  if (auto s = CheckRange("sensor_height_m", options.sensor_height_m, 0.5, 5); !s.ok()) return s;
  if (auto s = CheckRange("parked_share", options.parked_share, 0, 1); !s.ok()) return s;
  return CheckRange("moving_per_km", options.moving_per_km, 0, 200);
}

absl::Status Validate(const SimulateOptions& options) {
  if (auto s = Validate(options.town); !s.ok()) return s;
  if (auto s = Validate(options.session); !s.ok()) return s;
  return Validate(options.lidar);
}

std::string Describe(const SimulateOptions& options) {
  const auto& [town, session, lidar] = options;
  std::string text;
  const auto add = [&text](absl::string_view name, const std::string& value) {
    absl::StrAppend(&text, name, ": ", value, "\n");
  };
  add("town_seed", std::to_string(town.town_seed));
  add("length_m", NumberText(town.length_m));
  add("session_seed", std::to_string(session.session_seed));
  add("lane_shift_m", NumberText(session.lane_shift_m));
  add("reverse", session.reverse ? "true" : "false");
  add("spacing_m", NumberText(session.spacing_m));
  add("tilt_deg", NumberText(session.tilt_deg));
  add("sensor_height_m", NumberText(session.sensor_height_m));
  add("parked_share", NumberText(session.parked_share));
  add("moving_per_km", NumberText(session.moving_per_km));
  add("num_rays", std::to_string(lidar.num_rays));
  add("min_elevation_deg", NumberText(lidar.min_elevation_deg));
  add("max_elevation_deg", NumberText(lidar.max_elevation_deg));
  add("num_azimuths", std::to_string(lidar.num_azimuths));
  add("fov_deg", NumberText(lidar.fov_deg));
  add("max_range_m", NumberText(lidar.max_range_m));
  add("range_sigma_m", NumberText(lidar.range_sigma_m));
  add("dropout", NumberText(lidar.dropout));
  return text;
}

absl::StatusOr<SimulatedDrive> SimulatedDrive::Create(const SimulateOptions& options) {
  if (auto s = Validate(options); !s.ok()) return s;
  absl::StatusOr<Town> town = MakeTown(options.town);
  if (!town.ok()) return town.status();
  return SimulatedDrive(std::make_unique<const State>(options, *std::move(town)));
}

SimulatedDrive::SimulatedDrive(std::unique_ptr<const State> state) : state_(std::move(state)) {}
SimulatedDrive::SimulatedDrive(SimulatedDrive&&) noexcept = default;
SimulatedDrive& SimulatedDrive::operator=(SimulatedDrive&&) noexcept = default;
SimulatedDrive::~SimulatedDrive() = default;

const SimulateOptions& SimulatedDrive::options() const { return state_->options; }
const Town& SimulatedDrive::town() const { return state_->town; }
std::size_t SimulatedDrive::size() const { return state_->poses.size(); }
const Pose& SimulatedDrive::T_map_sensor(std::size_t i) const { return state_->poses[i]; }

std::int64_t SimulatedDrive::stamp_ns(std::size_t i) const {
  const double step_ns = state_->options.session.spacing_m / kSpeed_mps * 1e9;
  return static_cast<std::int64_t>(static_cast<double>(i) * step_ns);
}

PointCloud SimulatedDrive::Scan(std::size_t i) const {
  const Pose& pose = state_->poses[i];
  const LidarOptions& lidar = state_->options.lidar;
  const Eigen::Vector2d at = pose.translation().head<2>();
  Eigen::Vector2d axis(pose.linear()(0, 0), pose.linear()(1, 0));
  axis /= std::sqrt(axis.x() * axis.x() + axis.y() * axis.y());
  std::vector<Solid> solids;
  state_->fixed.AppendAround(at, lidar.max_range_m, solids);
  state_->standing.AppendAround(at, lidar.max_range_m, solids);
  state_->moving.AppendAround(at, axis, lidar.max_range_m, static_cast<double>(stamp_ns(i)) * 1e-9,
                              solids);
  return CastScan(lidar, state_->town.ground, solids, pose,
                  Mix(Mix(state_->options.session.session_seed, 0x5CA), i));
}

}  // namespace scanloc::sim
