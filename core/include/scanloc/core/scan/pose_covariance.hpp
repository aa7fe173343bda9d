#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// Covariance of a pose T_a_b: x, y, z of b's origin along the axes of a [m²], then the rotations
/// of b about the axes of a, taken through b's origin: roll, pitch, yaw [rad²]. As that of
/// geometry_msgs/PoseWithCovariance.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// Of the same pose in a frame that is turned: along the axes of c, by those of a.
[[nodiscard]] PoseCovariance Rotated(const Eigen::Matrix3d& R_c_a,
                                     const PoseCovariance& covariance);

/// Of a frame that is fixed to b, with its origin at lever_m from b's along the axes of a: turns of
/// b move it.
[[nodiscard]] PoseCovariance MovedBy(const Eigen::Vector3d& lever_m,
                                     const PoseCovariance& covariance);

/// How far an estimated pose is from the true one in the terms of a covariance of T_a_b.
[[nodiscard]] Eigen::Matrix<double, 6, 1> ErrorOf(const Pose& estimated, const Pose& truth);

/// OK if a covariance is symmetric and has no negative eigenvalue, else InvalidArgument.
[[nodiscard]] absl::Status CheckCovariance(const PoseCovariance& covariance);

}  // namespace scanloc
