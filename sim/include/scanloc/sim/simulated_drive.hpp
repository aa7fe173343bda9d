#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/sim/lidar_sim.hpp"
#include "scanloc/sim/town.hpp"
#include "scanloc/sim/world.hpp"

namespace scanloc::sim {

/// One drive along the route of a town or another world. All its sessions share its frame, so their
/// poses are exact with respect to each other.
struct SessionOptions {
  std::uint64_t session_seed = 1;  ///< of traffic, way of driving and noise
  /// How far left of the right-hand lane the vehicle keeps, seen in the route's forward direction
  /// whatever the direction of the drive [m]; in [-4, 7.5]. 3.5 is the opposite lane.
  double lane_shift_m = 0.0;
  bool reverse = false;          ///< the same path from its end to its beginning
  double spacing_m = 1.5;        ///< of scans, along the route's centre line; in [0.1, 100]
  double tilt_deg = 0.0;         ///< roll and pitch of each scan are random within ±; in [0, 30]
  double sensor_height_m = 1.8;  ///< above ground, in [0.1, 10]
  /// Roll, pitch and yaw of the sensor on what carries it, R = Rz·Ry·Rx; each in [-180, 180].
  Eigen::Vector3d mount_deg = Eigen::Vector3d::Zero();
  /// The part of the route that is driven, from its beginning whatever the direction [m]; to_m 0:
  /// to the end.
  double from_m = 0.0;
  double to_m = 0.0;
  double odometry_noise_percent = 0.0;  ///< 0: no odometry is written; in [0, 50]
  double parked_share = 0.6;            ///< of parking slots that are taken, in [0, 1]
  double moving_per_km = 25.0;          ///< moving vehicles per km of street, in [0, 200]
};

struct SimulateOptions {
  TownOptions town;
  SessionOptions session;
  LidarOptions lidar;
  WorldOptions world;
};

/// OK, or InvalidArgument that names the first bad field, its value and the allowed range.
[[nodiscard]] absl::Status Validate(const SessionOptions& options);
[[nodiscard]] absl::Status Validate(const SimulateOptions& options);

/// The options as lines of `name: value`.
[[nodiscard]] std::string Describe(const SimulateOptions& options);

/// A LiDAR drive through a made town or another world. Immutable after Create; any number of
/// threads may call any method at once. The same options give the same scans and poses, bit for
/// bit.
class SimulatedDrive {
 public:
  /// Makes the town and its traffic; scans are cast on demand. InvalidArgument as Validate.
  [[nodiscard]] static absl::StatusOr<SimulatedDrive> Create(const SimulateOptions& options);

  SimulatedDrive(SimulatedDrive&&) noexcept;
  SimulatedDrive& operator=(SimulatedDrive&&) noexcept;
  ~SimulatedDrive();

  [[nodiscard]] const SimulateOptions& options() const;
  /// Empty in other worlds.
  [[nodiscard]] const Town& town() const;

  /// Number of scans, at least 1. The methods below require i < size().
  [[nodiscard]] std::size_t size() const;
  /// The sensor's true pose in the world's frame.
  [[nodiscard]] const Pose& T_map_sensor(  // NOLINT(readability-identifier-naming): frames in names
      std::size_t i) const;
  /// When the scan was taken, from 0 at the first scan.
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const;
  /// Casts the scan: some milliseconds.
  [[nodiscard]] PointCloud Scan(std::size_t i) const;

 private:
  struct State;
  explicit SimulatedDrive(std::unique_ptr<const State> state);
  std::unique_ptr<const State> state_;
};

/// The same poses as a robot reckons them that began at the first: scale, heading and height drift,
/// so that after some hundred metres about `percent` of the distance is wrong.
[[nodiscard]] std::vector<Pose> Reckon(const std::vector<Pose>& T_map_sensor, double percent,
                                       std::uint64_t seed);

}  // namespace scanloc::sim
