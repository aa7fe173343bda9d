#pragma once

#include <Eigen/Geometry>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc {

/// A rigid transform T_a_b that maps points from frame b into frame a [m].
using Pose = Eigen::Isometry3d;

/// Makes a pose of the 3×4 matrix [R t].
///
/// The rotation part may be off by the rounding of a text file: it is replaced by the nearest
/// rotation. InvalidArgument if an element is not finite, if R is not a rotation within 1e-3, or if
/// the translation lies beyond limits::kMaxTranslation_m.
[[nodiscard]] absl::StatusOr<Pose> PoseFromMatrix(const Eigen::Matrix<double, 3, 4>& matrix);

/// Makes a pose of a translation [m] and a quaternion, which is normalised.
///
/// InvalidArgument as for PoseFromMatrix, and if the quaternion's norm is not 1 within 1e-2.
[[nodiscard]] absl::StatusOr<Pose> PoseFromQuaternion(const Eigen::Vector3d& translation_m,
                                                      const Eigen::Quaterniond& rotation);

/// T_place_query of a query displaced by lateral_m along the place's +y and headed yaw_rad
/// counter-clockwise from the place's +x: Trans(0, lateral_m, 0) · RotZ(yaw_rad).
[[nodiscard]] Pose PlanarOffset(double lateral_m, double yaw_rad);

/// The heading of a pose in the plane [rad], in (-π, π].
[[nodiscard]] double Yaw(const Pose& pose);

/// The same angle in (-π, π] [rad].
[[nodiscard]] double WrapAngle(double angle_rad);

}  // namespace scanloc
