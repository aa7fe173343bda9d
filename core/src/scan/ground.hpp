#pragma once

#include <optional>

#include "scan/upright.hpp"
#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc {

/// The most that a sensor stands above its ground.
inline constexpr double kMaxSensorHeight_m = 100.0;

/// The ground that a scan was taken on, however its sensor is mounted.
///
/// First the plane through the lowest points of cells is tried, which is right for a sensor that
/// stands about upright: few voxels may lie below it. Where it is not, the ground is searched for
/// (SearchGround). Where too little of the ground is seen for either, the sensor is taken to be
/// upright, sensor_height_m above it. None: there is much to be seen, and of no direction can be
/// said that it is up.
[[nodiscard]] std::optional<GroundPlane> FindGround(const PointCloud& voxels,
                                                    const GroundParams& params,
                                                    double sensor_height_m);

}  // namespace scanloc
