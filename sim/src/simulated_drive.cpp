#include "scanloc/sim/simulated_drive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "poses.hpp"
#include "random.hpp"
#include "scanloc/core/status_macros.hpp"
#include "sim_text.hpp"
#include "town/town_cells.hpp"
#include "town/town_traffic.hpp"
#include "worlds/scene.hpp"
#include "worlds/walk.hpp"

namespace scanloc::sim {
namespace {

constexpr double kSpeed_mps = 8.0;
constexpr double kWalkingSpeed_mps = 1.2;

/// Finds the solids around a point. Immutable; any number of threads may look.
class SolidIndex {
 public:
  explicit SolidIndex(const std::vector<Solid>& solids) {
    for (const Solid& solid : solids) {
      max_radius_m_ = std::max(max_radius_m_, solid.half_length_m + solid.half_width_m);
      cells_[CellKey(solid.center, kCell_m)].push_back(solid);
    }
  }

  /// Appends every solid that comes within radius_m of the point, and some that do not, in an order
  /// that depends on the point alone.
  void AppendAround(const Eigen::Vector2d& point, double radius_m, std::vector<Solid>& to) const {
    const Eigen::Vector2d reach = Eigen::Vector2d::Constant(radius_m + max_radius_m_);
    VisitCells(point - reach, point + reach, kCell_m, [&](std::uint64_t key) {
      const auto cell = cells_.find(key);
      if (cell != cells_.end()) to.insert(to.end(), cell->second.begin(), cell->second.end());
    });
  }

 private:
  static constexpr double kCell_m = 32.0;

  std::unordered_map<std::uint64_t, std::vector<Solid>> cells_;  // by the cell of the centre
  double max_radius_m_ = 0.0;
};

}  // namespace

struct SimulatedDrive::State {
  State(const SimulateOptions& simulate, Town made)
      : options(simulate),
        town(std::move(made)),
        ground(&town.ground),
        poses(PosesAlong(town, options.session)),
        fixed(town.fixed),
        standing(MakeStandingTraffic(town, options.session)),
        moving(std::in_place, town, options.session) {}
  State(const SimulateOptions& simulate, Scene made)
      : options(simulate),
        scene_ground(std::move(made.ground)),
        ground(&scene_ground),
        poses(PosesAlong(Walk(std::move(made.walk)), options.session)),
        fixed(made.solids),
        standing({}) {}

  SimulateOptions options;
  Town town;            // empty in other worlds
  Ground scene_ground;  // of other worlds
  const Ground* ground;
  std::vector<Pose> poses;
  SolidIndex fixed;
  SolidIndex standing;
  std::optional<MovingTraffic> moving;
};

absl::Status Validate(const SessionOptions& options) {
  RETURN_IF_ERROR(CheckRange("lane_shift_m", options.lane_shift_m, -4, 7.5));
  RETURN_IF_ERROR(CheckRange("spacing_m", options.spacing_m, 0.1, 100));
  RETURN_IF_ERROR(CheckRange("tilt_deg", options.tilt_deg, 0, 30));
  RETURN_IF_ERROR(CheckRange("sensor_height_m", options.sensor_height_m, 0.1, 10));
  for (const double angle : options.mount_deg) {
    RETURN_IF_ERROR(CheckRange("mount_deg", angle, -180, 180));
  }
  RETURN_IF_ERROR(CheckRange("from_m", options.from_m, 0, 1e6));
  RETURN_IF_ERROR(CheckRange("to_m", options.to_m, 0, 1e6));
  if (options.to_m > 0.0 && options.to_m <= options.from_m) {
    return absl::InvalidArgumentError(
        absl::StrCat("to_m is ", NumberText(options.to_m), "; it must be greater than from_m, ",
                     NumberText(options.from_m), ", or 0 for the end of the route"));
  }
  RETURN_IF_ERROR(CheckRange("odometry_noise_percent", options.odometry_noise_percent, 0, 50));
  RETURN_IF_ERROR(CheckRange("parked_share", options.parked_share, 0, 1));
  return CheckRange("moving_per_km", options.moving_per_km, 0, 200);
}

absl::Status Validate(const SimulateOptions& options) {
  RETURN_IF_ERROR(Validate(options.town));
  RETURN_IF_ERROR(Validate(options.world));
  RETURN_IF_ERROR(Validate(options.session));
  return Validate(options.lidar);
}

std::string Describe(const SimulateOptions& options) {
  const auto& [town, session, lidar, world] = options;
  std::string text;
  const auto add = [&text](absl::string_view name, const std::string& value) {
    absl::StrAppend(&text, name, ": ", value, "\n");
  };
  add("town_seed", std::to_string(town.town_seed));
  add("length_m", NumberText(town.length_m));
  if (town.rebuilt_share > 0.0) {
    add("rebuilt_share", NumberText(town.rebuilt_share));
    add("rebuilt_seed", std::to_string(town.rebuilt_seed));
  }
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
  if (options.session.odometry_noise_percent > 0.0) {
    add("odometry_noise_percent", NumberText(session.odometry_noise_percent));
  }
  if (session.from_m > 0.0 || session.to_m > 0.0) {
    add("from_m", NumberText(session.from_m));
    add("to_m", NumberText(session.to_m));
  }
  if (!session.mount_deg.isZero()) {
    add("mount_deg",
        absl::StrCat(NumberText(session.mount_deg.x()), ",", NumberText(session.mount_deg.y()), ",",
                     NumberText(session.mount_deg.z())));
  }
  if (world.kind == WorldKind::kTown) return text;
  add("world", WorldKindName(world.kind));
  add("num_floors", std::to_string(world.num_floors));
  add("num_aisles", std::to_string(world.num_aisles));
  add("changed_share", NumberText(world.changed_share));
  return text;
}

absl::StatusOr<SimulatedDrive> SimulatedDrive::Create(const SimulateOptions& options) {
  RETURN_IF_ERROR(Validate(options));
  std::unique_ptr<const State> state;
  if (options.world.kind == WorldKind::kTown) {
    ASSIGN_OR_RETURN(Town town, MakeTown(options.town));
    state = std::make_unique<const State>(options, std::move(town));
  } else {
    state = std::make_unique<const State>(
        options, MakeScene({options.town.town_seed, options.session.session_seed,
                            options.town.length_m, options.world}));
  }
  if (state->poses.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("no scan lies between from_m, ", NumberText(options.session.from_m),
                     ", and to_m or the end of the route; choose less, or a smaller spacing_m"));
  }
  return SimulatedDrive(std::move(state));
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
  const double speed_mps = state_->moving ? kSpeed_mps : kWalkingSpeed_mps;
  const double step_ns = state_->options.session.spacing_m / speed_mps * 1e9;
  return static_cast<std::int64_t>(static_cast<double>(i) * step_ns);
}

PointCloud SimulatedDrive::Scan(std::size_t i) const {
  const Pose& pose = state_->poses[i];
  const LidarOptions& lidar = state_->options.lidar;
  const Eigen::Vector2d at = pose.translation().head<2>();
  std::vector<Solid> solids;
  state_->fixed.AppendAround(at, lidar.max_range_m, solids);
  state_->standing.AppendAround(at, lidar.max_range_m, solids);
  if (state_->moving) {
    Eigen::Vector2d axis(pose.linear()(0, 0), pose.linear()(1, 0));
    const double norm = std::sqrt(axis.x() * axis.x() + axis.y() * axis.y());
    axis = norm > 0.0 ? Eigen::Vector2d(axis / norm) : Eigen::Vector2d::UnitX();
    state_->moving->AppendAround(at, axis, lidar.max_range_m,
                                 static_cast<double>(stamp_ns(i)) * 1e-9, solids);
  }
  return CastScan(lidar, *state_->ground, solids, pose,
                  Mix(Mix(state_->options.session.session_seed, 0x5CA), i));
}

}  // namespace scanloc::sim
