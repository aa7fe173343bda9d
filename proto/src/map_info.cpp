#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "scanloc/proto/map_state.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc {
namespace {

std::optional<Box> ExtentOf(const std::vector<Place>& places) {
  if (places.empty()) return std::nullopt;
  Box extent{.min_m = places.front().T_map_place.translation(),
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
          .generation = 0,
          .geo_origin = map.geo_origin};
}

absl::StatusOr<PlacesPage> PageOfPlaces(const Map& map, int page_size,
                                        const std::string& page_token) {
  if (page_size < 0 || page_size > kMaxPlacesPerPage) {
    return absl::InvalidArgumentError(
        absl::StrCat("page_size is ", page_size, "; it must lie in [0, ", kMaxPlacesPerPage, "]"));
  }
  PlacesPage page{.content_id = map.content_id};
  const auto num_places = static_cast<std::int32_t>(map.places.size());
  if (!page_token.empty()) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(page_token, absl::MaxSplits('@', 1));
    if (!absl::SimpleAtoi(parts.first, &page.first_place) || page.first_place < 0) {
      return absl::InvalidArgumentError(absl::StrCat("page_token \"",
                                                     absl::CHexEscape(page_token.substr(0, 40)),
                                                     "\" was not given by this server"));
    }
    if (parts.second != map.content_id) {
      return absl::AbortedError("the map was replaced since the first page; begin anew");
    }
  }
  const std::int32_t begin = std::min(page.first_place, num_places);
  const std::int32_t end =
      begin + std::min(num_places - begin, page_size == 0 ? kMaxPlacesPerPage : page_size);
  page.places.assign(map.places.begin() + begin, map.places.begin() + end);
  if (end < num_places) page.next_page_token = absl::StrCat(end, "@", map.content_id);
  return page;
}

const char* StateName(MapState state) {
  switch (state) {
    case MapState::kLoading:
      return "loading";
    case MapState::kServing:
      return "serving";
    case MapState::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace scanloc
