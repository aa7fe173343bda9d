#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/geo/geo_frame.hpp"

namespace scanloc::report {

/// One place of a map, for programs that know nothing of maps.
struct ExportedPlace {
  std::size_t index = 0;
  std::string session;
  std::string scan;
  std::int64_t stamp_ns = 0;  ///< 0: none
  std::uint32_t num_voxels = 0;
  Pose T_map_place = Pose::Identity();
  std::optional<geo::GeoPosition> position;  ///< if it is known where the map stands
};

/// `csv`: a row a place, with latitude, longitude and altitude where they are known, and a column
/// `grid` if that is `utm` or `mgrs`. `tum`: stamp [s] x y z qx qy qz qw. `geojson`: a point a
/// place. `kml`, `gpx`: a track a session.
///
/// FailedPrecondition: a format or grid of the earth, and places of a map of which nobody knows
/// where it stands. InvalidArgument: no such format or grid.
[[nodiscard]] absl::StatusOr<std::string> ExportPlaces(std::span<const ExportedPlace> places,
                                                       const std::string& format,
                                                       const std::string& grid = "");

}  // namespace scanloc::report
