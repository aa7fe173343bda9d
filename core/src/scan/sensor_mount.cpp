#include "scanloc/core/scan/sensor_mount.hpp"

#include <cmath>
#include <numbers>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

absl::Status CheckOffset(const Eigen::Vector3d& offset_m) {
  if (offset_m.allFinite() && offset_m.cwiseAbs().maxCoeff() <= kMaxMountOffset_m) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("the sensor sits at (%g, %g, %g) m of the base; within ±%g m are allowed",
                      offset_m.x(), offset_m.y(), offset_m.z(), kMaxMountOffset_m));
}

absl::Status CheckBox(const Box& box) {
  static constexpr const char* kAxes = "XYZ";
  for (int axis = 0; axis < 3; ++axis) {
    const double low_m = box.min_m[axis];
    const double high_m = box.max_m[axis];
    if (low_m < high_m && low_m >= -kMaxSelfBox_m && high_m <= kMaxSelfBox_m) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "the box that is not seen goes from %c0 = %g m to %c1 = %g m; the first must be less than "
        "the second, both within ±%g m",
        kAxes[axis], low_m, kAxes[axis], high_m, kMaxSelfBox_m));
  }
  return absl::OkStatus();
}

bool Changes(const SensorMount& mount) {
  return mount.min_range_m > 0.0 || mount.self_box ||
         mount.T_base_sensor.linear() != Eigen::Matrix3d::Identity();
}

}  // namespace

absl::Status Validate(const SensorMount& mount) {
  const Pose& pose = mount.T_base_sensor;
  if (absl::Status status = PoseFromMatrix(pose.matrix().topRows<3>()).status(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrFormat("T_base_sensor: %s", status.message()));
  }
  if (absl::Status status = CheckOffset(pose.translation()); !status.ok()) return status;
  if (!(mount.min_range_m >= 0.0 && mount.min_range_m <= kMaxMinRange_m)) {  // also refuses NaN
    return absl::InvalidArgumentError(absl::StrFormat(
        "the nearest range is %g m; it must be in [0, %g]", mount.min_range_m, kMaxMinRange_m));
  }
  return mount.self_box ? CheckBox(*mount.self_box) : absl::OkStatus();
}

absl::StatusOr<Pose> MountPose(const Eigen::Vector3d& offset_m,
                               const Eigen::Vector3d& roll_pitch_yaw_deg) {
  if (absl::Status status = CheckOffset(offset_m); !status.ok()) return status;
  static constexpr const char* kNames[] = {"roll", "pitch", "yaw"};
  for (int i = 0; i < 3; ++i) {
    if (std::abs(roll_pitch_yaw_deg[i]) <= 180.0) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "the %s is %g; it must be in [-180, 180] degrees", kNames[i], roll_pitch_yaw_deg[i]));
  }
  const Eigen::Vector3d angles_rad = roll_pitch_yaw_deg * (std::numbers::pi / 180.0);
  Pose pose = Pose::Identity();
  pose.translate(offset_m);
  pose.rotate(Eigen::AngleAxisd(angles_rad.z(), Eigen::Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(angles_rad.y(), Eigen::Vector3d::UnitY()));
  pose.rotate(Eigen::AngleAxisd(angles_rad.x(), Eigen::Vector3d::UnitX()));
  return pose;
}

std::size_t ApplyMount(const SensorMount& mount, PointCloud& scan) {
  if (!Changes(mount)) return 0;
  const Eigen::Matrix3f rotation = mount.T_base_sensor.linear().cast<float>();
  const bool is_turned = rotation != Eigen::Matrix3f::Identity();
  const auto min_range_m = static_cast<float>(mount.min_range_m);
  Eigen::Vector3f min_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f max_m = Eigen::Vector3f::Zero();
  if (mount.self_box) {
    min_m = (mount.self_box->min_m - mount.T_base_sensor.translation()).cast<float>();
    max_m = (mount.self_box->max_m - mount.T_base_sensor.translation()).cast<float>();
  }
  std::size_t num_kept = 0;
  for (const Point& point : scan) {
    const Eigen::Vector3f given(point.x, point.y, point.z);
    if (given.squaredNorm() < min_range_m * min_range_m) continue;
    const Eigen::Vector3f p = is_turned ? Eigen::Vector3f(rotation * given) : given;
    // A point that is not finite is in no box.
    if (mount.self_box && (p.array() >= min_m.array()).all() && (p.array() <= max_m.array()).all())
      continue;
    scan[num_kept++] = {p.x(), p.y(), p.z()};
  }
  const std::size_t num_masked = scan.size() - num_kept;
  scan.resize(num_kept);
  return num_masked;
}

PointView Seen(const SensorMount& mount, PointView scan, PointCloud& buffer) {
  if (!Changes(mount)) return scan;
  buffer.assign(scan.begin(), scan.end());
  (void)ApplyMount(mount, buffer);
  return buffer;
}

Pose TurnedOfSensor(const SensorMount& mount, const Pose& T_map_sensor) {
  Pose T_map_turned = T_map_sensor;
  T_map_turned.linear() = T_map_sensor.linear() * mount.T_base_sensor.linear().transpose();
  return T_map_turned;
}

Pose BaseOfSensor(const SensorMount& mount, const Pose& T_map_sensor) {
  return T_map_sensor * mount.T_base_sensor.inverse();
}

Pose TurnedStep(const SensorMount& mount, const Pose& T_lastbase_base) {
  return BaseInTurned(mount) * T_lastbase_base * BaseInTurned(mount).inverse();
}

Pose BaseInTurned(const SensorMount& mount) {
  Pose T_turned_base = Pose::Identity();
  T_turned_base.translation() = -mount.T_base_sensor.translation();
  return T_turned_base;
}

}  // namespace scanloc
