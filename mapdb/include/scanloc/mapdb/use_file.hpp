#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/map_use.hpp"

/// How a map fared in use, in a small file of text beside it (docs/formats.md).
namespace scanloc::mapdb {

/// MAP.health
[[nodiscard]] std::string UseFileOf(const std::string& map_path);

[[nodiscard]] std::string EncodeUse(const MapUse& use);
/// InvalidArgument: no such text. DataLoss: one that is cut off or damaged. FailedPrecondition: of
/// a newer version.
[[nodiscard]] absl::StatusOr<MapUse> DecodeUse(const std::string& text);

/// That of a map of so many places. The errors of DecodeUse; DataLoss, too: it tells of a place
/// that the map does not have. NotFound: no such file. InvalidArgument: it is no file, or larger
/// than any of such a map, of which nothing is read.
[[nodiscard]] absl::StatusOr<MapUse> ReadUse(const std::string& path, std::int64_t num_places);

/// Puts the file in the place of the one before, whole and on disk or not at all.
[[nodiscard]] absl::Status WriteUse(const std::string& path, const MapUse& use);

}  // namespace scanloc::mapdb
