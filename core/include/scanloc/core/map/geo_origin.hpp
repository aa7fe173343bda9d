#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"

namespace scanloc {

/// Where on earth a map frame stands (WGS 84): one point of it, and which way it is turned. Its z
/// axis points up there, along the normal of the ellipsoid.
struct GeoOrigin {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;  ///< above the ellipsoid
  /// Of the map's x axis, clockwise from north: at 90 x points east and y north.
  double heading_deg = 90.0;
  /// The point of the map frame that is there [m].
  Eigen::Vector3d anchor_m = Eigen::Vector3d::Zero();

  friend bool operator==(const GeoOrigin&, const GeoOrigin&) = default;
};

/// A pose in such a map frame, on earth (WGS 84).
struct GeoPose {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;   ///< above the ellipsoid
  double heading_deg = 0.0;  ///< of its x axis, clockwise from true north, in [0, 360)

  friend bool operator==(const GeoPose&, const GeoPose&) = default;
};

/// InvalidArgument: a number that is not finite or out of range, named.
[[nodiscard]] absl::Status Validate(const GeoOrigin& origin);

}  // namespace scanloc
