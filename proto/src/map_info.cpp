#include <optional>
#include <vector>

#include "scanloc/proto/messages.hpp"

namespace scanloc {
namespace {

std::optional<Extent> ExtentOf(const std::vector<Place>& places) {
  if (places.empty()) return std::nullopt;
  Extent extent{.min_m = places.front().T_map_place.translation(),
                .max_m = places.front().T_map_place.translation()};
  for (const Place& place : places) {
    extent.min_m = extent.min_m.cwiseMin(place.T_map_place.translation());
    extent.max_m = extent.max_m.cwiseMax(place.T_map_place.translation());
  }
  return extent;
}

}  // namespace

MapInfo InfoOf(const std::string& name, const Map& map) {
  return {.name = name,
          .content_id = map.content_id,
          .params = map.params,
          .sessions = map.sessions,
          .num_places = static_cast<std::int64_t>(map.places.size()),
          .extent = ExtentOf(map.places),
          .generation = 0};
}

}  // namespace scanloc
