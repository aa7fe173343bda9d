#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "scanloc/core/pose.hpp"

/// Where sensors are mounted in the datasets whose frames are x forward, y right, z down.
namespace scanloc::dataset {

/// From x forward, y right, z down to x forward, y left, z up, and back.
[[nodiscard]] inline Pose Upward() {
  Pose flip = Pose::Identity();
  flip.rotate(Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX()));
  return flip;
}

/// Origin of NCLT's HDL-32E in the robot's frame, z down [m] (x_body_velodyne of the dataset).
inline const Eigen::Vector3d kNcltSensor_m(0.002, -0.004, -0.957);

/// A sensor in a vehicle's frame, z down: x y z [m], roll pitch yaw [rad].
struct Mount {
  Eigen::Vector3d origin_m;
  Eigen::Vector3d roll_pitch_yaw_rad;
};
/// Oxford Radar RobotCar, velodyne_left.txt and velodyne_right.txt of its SDK's extrinsics.
inline const Mount kOxfordLeft = {{-0.60072, -0.34077, -0.26837}, {-0.0053948, -0.041998, -3.1337}};
inline const Mount kOxfordRight = {{-0.61153, 0.55676, -0.27023}, {0.0027052, -0.041999, -3.1357}};

/// R_z(yaw) · R_y(pitch) · R_x(roll).
[[nodiscard]] inline Eigen::Matrix3d RotationOf(const Eigen::Vector3d& roll_pitch_yaw_rad) {
  return (Eigen::AngleAxisd(roll_pitch_yaw_rad.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(roll_pitch_yaw_rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_pitch_yaw_rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Origin of Oxford's merged scans in the vehicle's frame, z down [m].
[[nodiscard]] inline Eigen::Vector3d OxfordSensor_m() {
  return 0.5 * (kOxfordLeft.origin_m + kOxfordRight.origin_m);
}

}  // namespace scanloc::dataset
