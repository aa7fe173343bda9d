#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::dataset {

/// Where a GNSS receiver was (WGS 84; above the ellipsoid).
struct GnssFix {
  std::int64_t stamp_ns = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
};

/// In the order of their times: the sensor_msgs/NavSatFix of a bag (.mcap, .db3, .bag, or a folder
/// of rosbag2), or the rows of a CSV file whose header names `stamp` (in a unit as of ReadTimes),
/// `latitude`, `longitude` and `altitude`, among others. What says itself that it is no fix is left
/// out.
///
/// NotFound, PermissionDenied. InvalidArgument, with file and line: a column is missing, a field is
/// no number, or there is no fix at all. Else as of Bag.
[[nodiscard]] absl::StatusOr<std::vector<GnssFix>> ReadGnssFixes(const std::string& path);

/// At a time: between the two around it, which are at most 2 s apart. None if there are no such
/// two.
[[nodiscard]] std::optional<GnssFix> FixAt(std::span<const GnssFix> fixes, std::int64_t stamp_ns);

}  // namespace scanloc::dataset
