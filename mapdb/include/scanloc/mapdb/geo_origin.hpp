#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/map/geo_origin.hpp"

namespace scanloc::mapdb {

/// As the file holds it: latitude, longitude, altitude, heading and the anchor, with blanks
/// between, each in the shortest form that gives the same number again.
[[nodiscard]] std::string EncodeGeoOrigin(const GeoOrigin& origin);
/// InvalidArgument: not seven numbers, or as Validate.
[[nodiscard]] absl::StatusOr<GeoOrigin> DecodeGeoOrigin(const std::string& text);

/// Writes into a map where its frame stands; its content and the answers stay the same. The errors
/// of MapBuilder::Append, and InvalidArgument as Validate.
[[nodiscard]] absl::Status SetGeoOrigin(const std::string& path, const GeoOrigin& origin);

}  // namespace scanloc::mapdb
