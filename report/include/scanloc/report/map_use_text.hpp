#pragma once

#include <span>
#include <string>

#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map_use.hpp"
#include "scanloc/report/json.hpp"

/// How a map fared in use, told.
namespace scanloc::report {

[[nodiscard]] Json MapUseToJson(const MapUse& use);

/// Counts, and the places in most trouble, for a person. The places are those of the map.
[[nodiscard]] std::string MapUseAsText(const MapUse& use, std::span<const Place> places);

}  // namespace scanloc::report
