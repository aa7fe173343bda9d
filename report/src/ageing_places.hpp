#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map_use.hpp"

namespace scanloc::report {

/// The places that age, those in most trouble first: neighbours are judged together, so that an odd
/// look is none, and beside a place that clearly ages less is enough, as of slam::Compare. A place
/// that was seen too seldom is none, nor is one that the map does not have.
[[nodiscard]] std::vector<std::int32_t> AgeingPlaces(const MapUse& use,
                                                     std::span<const Place> places);

}  // namespace scanloc::report
