#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "scanloc/core/scan/pose.hpp"

/// Where the sensors of published datasets are mounted.
namespace scanloc::dataset {

/// From x forward, y right, z down to x forward, y left, z up, and back.
[[nodiscard]] inline Pose Upward() {
  Pose flip = Pose::Identity();
  flip.rotate(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX()));
  return flip;
}

/// Origin of NCLT's HDL-32E in the robot's frame, z down [m] (x_body_velodyne of the dataset).
inline const Eigen::Vector3d kNcltSensor_m(0.002, -0.004, -0.957);

/// A sensor in a vehicle's frame: x y z [m], roll pitch yaw [rad].
struct Mount {
  Eigen::Vector3d origin_m;
  Eigen::Vector3d roll_pitch_yaw_rad;
};
/// Oxford Radar RobotCar: ins.txt, velodyne_left.txt and velodyne_right.txt of the extrinsics of
/// its SDK. The vehicle's frame is x forward, y right, z down.
inline const Mount kOxfordIns = {{-1.7132, 0.1181, 1.1948}, {-0.0125, 0.0400, 0.0050}};
inline const Mount kOxfordLeft = {{-0.60072, -0.34077, -0.26837}, {-0.0053948, -0.041998, -3.1337}};
inline const Mount kOxfordRight = {{-0.61153, 0.55676, -0.27023}, {0.0027052, -0.041999, -3.1357}};

/// R_z(yaw) · R_y(pitch) · R_x(roll).
[[nodiscard]] inline Eigen::Matrix3d RotationOf(const Eigen::Vector3d& roll_pitch_yaw_rad) {
  return (Eigen::AngleAxisd(roll_pitch_yaw_rad.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(roll_pitch_yaw_rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_pitch_yaw_rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

[[nodiscard]] inline Pose PoseOf(const Mount& mount) {
  Pose T_vehicle_sensor = Pose::Identity();
  T_vehicle_sensor.translate(mount.origin_m);
  T_vehicle_sensor.rotate(RotationOf(mount.roll_pitch_yaw_rad));
  return T_vehicle_sensor;
}

/// Oxford's mount in the frame of the INS, z down, which is level where the vehicle's is not.
[[nodiscard]] inline Pose InOxfordIns(const Mount& mount) {
  return PoseOf(kOxfordIns).inverse() * PoseOf(mount);
}

/// Origin of Oxford's merged scans in the frame of the INS, z down [m].
[[nodiscard]] inline Eigen::Vector3d OxfordSensor_m() {
  return 0.5 * (InOxfordIns(kOxfordLeft).translation() + InOxfordIns(kOxfordRight).translation());
}

/// MulRan's Ouster in the frame of the vehicle that global_pose.csv is of: x forward, y left, z up.
[[nodiscard]] inline Pose MulranOuster() {
  constexpr double kRadPerDeg = EIGEN_PI / 180.0;
  return PoseOf({{1.7042, -0.021, 1.8047}, kRadPerDeg * Eigen::Vector3d(0.0001, 0.0003, 179.6654)});
}

}  // namespace scanloc::dataset
