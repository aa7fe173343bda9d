#pragma once

#include <Eigen/Core>
#include <optional>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc {

/// A plane that a robot may stand on, in the sensor frame: normal · p + height_m = 0. The normal is
/// up, so that the sensor is height_m above it.
struct GroundPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double height_m = 0.0;
};

/// T_level_sensor = RotY(pitch) · RotX(roll) takes a plane's normal to +z; roll in (-π, π], pitch
/// in
/// [-π/2, π/2].
struct RollPitch {
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
};
[[nodiscard]] RollPitch LeanOf(const GroundPlane& plane);

/// How many voxels lie clearly below the plane, relative to those on it: next to none below what a
/// robot stands on, many below a plane that cuts through the scene. Infinite where hardly any lie
/// on it within reach.
[[nodiscard]] double ShareBelow(const PointCloud& voxels, const GroundPlane& plane,
                                const GroundParams& params);

/// The ground of a scan whose sensor is mounted in any way: of the planes through the voxels, that
/// with the most on it and nothing below, as far from the sensor as sensor_height_m says. None if
/// no plane is like that, or if several are that face different ways: up cannot be told then.
///
/// Planes are drawn at random, of the same seed for every scan. O(voxels), a few ms.
[[nodiscard]] std::optional<GroundPlane> SearchGround(const PointCloud& voxels,
                                                      const GroundParams& params,
                                                      double sensor_height_m);

}  // namespace scanloc
