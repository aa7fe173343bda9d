#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

/// A solid as seen from the sensor's position.
struct SeenSolid {
  Solid solid;
  Eigen::Vector2d offset;  // of the sensor from the solid's centre, in the solid's axes
  double z_low = 0.0;      // relative to the sensor
  double z_high = 0.0;
  double near_m = 0.0;  // horizontal distance bounds
  double far_m = 0.0;
  double azimuth_rad = 0.0;      // of the centre, in the map
  double half_extent_rad = 0.0;  // around it; π if the sensor is inside the footprint
  std::size_t index = 0;         // in the caller's span
};

/// `index` is the solid's place in the caller's span.
[[nodiscard]] SeenSolid See(const Solid& solid, std::size_t index, const Eigen::Vector3d& sensor);

/// Where a beam ends that ends on nothing.
inline constexpr double kNoHit_m = std::numeric_limits<double>::infinity();

/// Range at which a beam in a unit direction ends on the solid, or kNoHit_m. `bits` are the beam's
/// random bits, which say how deep it goes into foliage.
[[nodiscard]] double HitSolid(const SeenSolid& seen, const Eigen::Vector3d& direction,
                              std::uint64_t bits);

/// Range at which a beam ends on a street or on what a kerb raises, or `limit_m` if that is less.
[[nodiscard]] double HitGround(const Ground& ground, const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction, double limit_m);

}  // namespace scanloc::sim
