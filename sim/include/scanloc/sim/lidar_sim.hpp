#pragma once

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

/// A spinning multi-beam LiDAR.
struct LidarOptions {
  int num_rays = 64;  ///< one above the other, evenly spread over the elevations; in [16, 128]
  /// Lowest and highest ray [deg], in [-50, 50]. The default looks down as an HDL-64E and up as an
  /// OS1, so that it sees the height of buildings across a street; the same for every num_rays.
  double min_elevation_deg = -24.8;
  double max_elevation_deg = 15.0;
  int num_azimuths = 1024;      ///< a full turn, in [90, 4096]
  double fov_deg = 360.0;       ///< azimuths kept, centred on +x; in [10, 360]
  double max_range_m = 100.0;   ///< in [5, 300]
  double range_sigma_m = 0.02;  ///< noise along the beam, in [0, 1]
  /// Share of returns lost at no distance, in [0, 0.2]; grows with the square of the range to five
  /// times as much at max_range_m.
  double dropout = 0.01;
};

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const LidarOptions& options);

/// One turn of the sensor, in the sensor frame, azimuth by azimuth counter-clockwise from behind,
/// each from the lowest ray to the highest. Beams that end on nothing within max_range_m give no
/// point; a solid around the sensor itself is transparent.
///
/// The same arguments give the same bits on any machine. Requires Validate(options).ok() and a
/// sensor that stands above the ground. Casting is quick as long as the steepest ray and the tilt
/// together stay below 88°.
[[nodiscard]] PointCloud CastScan(const LidarOptions& options, const Ground& ground,
                                  std::span<const Solid> solids, const Pose& T_map_sensor,
                                  std::uint64_t noise_seed);

}  // namespace scanloc::sim
