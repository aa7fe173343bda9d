#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// A box with sides along the axes of a frame [m].
struct Box {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();

  friend bool operator==(const Box&, const Box&) = default;
};

/// How a sensor sits on a robot, and what of a scan is the robot itself. A value: it can be stored
/// and sent.
///
/// Scans are described in the *turned* frame: the sensor's origin with the axes of the robot's base
/// frame (x forward, y left, z up). Where the sensor sits on the robot does not change what it
/// sees, so that heights stay those above `sensor_height_m`, and a map of scans that were taken
/// upright serves a robot whose sensor hangs or lies.
struct SensorMount {
  Pose T_base_sensor = Pose::Identity();
  double min_range_m = 0.0;     ///< points nearer to the sensor are left out
  std::optional<Box> self_box;  ///< in the base frame: points within are left out (body, trailer)

  friend bool operator==(const SensorMount& a, const SensorMount& b) {
    return a.T_base_sensor.matrix() == b.T_base_sensor.matrix() && a.min_range_m == b.min_range_m &&
           a.self_box == b.self_box;
  }
};

/// Bounds of a mount [m].
inline constexpr double kMaxMountOffset_m = 100.0;
inline constexpr double kMaxMinRange_m = 100.0;
inline constexpr double kMaxSelfBox_m = 1000.0;

/// OK, or InvalidArgument that names what is out of range.
[[nodiscard]] absl::Status Validate(const SensorMount& mount);

/// T_base_sensor of an offset [m] and angles [deg] in [-180, 180] as those of URDF: the sensor's
/// axes are turned by roll about the base's x, then by pitch about y, then by yaw about z.
/// InvalidArgument: an angle or the offset out of range.
[[nodiscard]] absl::StatusOr<Pose> MountPose(const Eigen::Vector3d& offset_m,
                                             const Eigen::Vector3d& roll_pitch_yaw_deg);

/// Makes a scan what is described of it: the points that are not left out, in the turned frame, in
/// the order given. Points that are not finite are let through: it is the Describer that skips and
/// counts them. Returns how many are left out. Requires Validate(mount).ok().
std::size_t ApplyMount(const SensorMount& mount, PointCloud& scan);

/// The same of a scan that is not to be changed: the scan itself where there is nothing to do, else
/// `buffer`, which is overwritten.
[[nodiscard]] PointView Seen(const SensorMount& mount, PointView scan, PointCloud& buffer);

/// T_map_turned of a sensor.
[[nodiscard]] Pose TurnedOfSensor(const SensorMount& mount, const Pose& T_map_sensor);
/// T_map_base of a sensor.
[[nodiscard]] Pose BaseOfSensor(const SensorMount& mount, const Pose& T_map_sensor);
/// How the turned frame moves when the base moves so: T_last_scan of the one from that of the
/// other.
[[nodiscard]] Pose TurnedStep(const SensorMount& mount, const Pose& T_lastbase_base);

/// T_turned_base: the base's origin as seen from the sensor, along the base's axes.
[[nodiscard]] Pose BaseInTurned(const SensorMount& mount);

}  // namespace scanloc
