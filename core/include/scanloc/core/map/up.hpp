#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"

namespace scanloc {

/// The direction of the map frame that its places call up: the normals of the ground that
/// they stand on, of some 1,000 of them, evenly taken, where there are more. +z for a map without
/// structures.
///
/// InvalidArgument if fewer than half of the places agree within 30°: then the rotations of the
/// poses are not those of the scans.
[[nodiscard]] absl::StatusOr<Eigen::Vector3d> FindUp(const Map& map);

}  // namespace scanloc
