#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "absl/status/statusor.h"
#include "scanloc/geo/geo_frame.hpp"

namespace scanloc::geo {

/// The same point in the map frame and on earth, as a GNSS receiver has it.
struct Fix {
  Eigen::Vector3d at_map_m = Eigen::Vector3d::Zero();
  GeoPosition position;
};

struct FittedOrigin {
  GeoOrigin origin;  ///< anchored amid the fixes
  std::size_t num_used = 0;
  double rms_m = 0.0;  ///< in the plane, of those used
  double max_m = 0.0;
};

/// The origin under which most fixes lie on the map, in the plane within 5 m; the others, jumps
/// among houses, do not pull at it. Heights by their median. The same fixes give the same origin.
///
/// FailedPrecondition: fewer than five fixes, all within 20 m, or less than half agree; with the
/// numbers.
[[nodiscard]] absl::StatusOr<FittedOrigin> FitOrigin(std::span<const Fix> fixes);

}  // namespace scanloc::geo
