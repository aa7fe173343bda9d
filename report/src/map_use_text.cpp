#include "scanloc/report/map_use_text.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "ageing_places.hpp"

namespace scanloc::report {
namespace {

constexpr std::size_t kMaxPlacesInText = 20;

std::string DayText(std::int64_t since_1970_ns) {
  if (since_1970_ns == 0) return "-";
  return absl::FormatTime("%Y-%m-%d %H:%M", absl::FromUnixNanos(since_1970_ns),
                          absl::UTCTimeZone());
}

std::string RowText(std::int32_t place, const PlaceUse& use, const Eigen::Vector3d& at) {
  const auto of_found = [num_found = use.num_found](double share) {
    return num_found == 0 ? "-" : absl::StrFormat("%.2f", share);
  };
  return absl::StrFormat("  %8d %10.1f %10.1f %7d %8d %6s %9s %7s  %s\n", place, at.x(), at.y(),
                         use.num_found, use.num_refused, of_found(use.confidence),
                         of_found(use.disagreement), of_found(use.recent_disagreement),
                         DayText(std::max(use.last_found_ns, use.last_refused_ns)));
}

}  // namespace

Json MapUseToJson(const MapUse& use) {
  Json json{{"content_id", use.content_id},
            {"since_ns", use.since_ns},
            {"until_ns", use.until_ns},
            {"num_localized", use.num_localized},
            {"num_ambiguous", use.num_ambiguous},
            {"num_not_recognized", use.num_not_recognized},
            {"num_insufficient_scan", use.num_insufficient},
            {"num_refused_nowhere", use.num_refused_nowhere},
            {"places", Json::array()}};
  for (const auto& [place, of_place] : use.places) {
    json["places"].push_back({{"place", place},
                              {"num_found", of_place.num_found},
                              {"num_refused", of_place.num_refused},
                              {"confidence", of_place.confidence},
                              {"disagreement", of_place.disagreement},
                              {"recent_disagreement", of_place.recent_disagreement},
                              {"last_found_ns", of_place.last_found_ns},
                              {"last_refused_ns", of_place.last_refused_ns}});
  }
  return json;
}

std::string MapUseAsText(const MapUse& use, std::span<const Place> places) {
  const auto num_found = std::ranges::count_if(
      use.places, [](const auto& place) { return place.second.num_found > 0; });
  std::string text = absl::StrFormat(
      "health from use, %s to %s UTC\n"
      "  answers         %d localized, %d ambiguous, %d not recognised, %d scans with too few "
      "points\n"
      "  places          %d of %d were found; %d refused queries were near none\n",
      DayText(use.since_ns), DayText(use.until_ns), use.num_localized, use.num_ambiguous,
      use.num_not_recognized, use.num_insufficient, num_found, places.size(),
      use.num_refused_nowhere);
  const std::vector<std::int32_t> rows = AgeingPlaces(use, places);
  if (rows.empty()) return text + "  no place ages, as far as was seen\n";
  absl::StrAppendFormat(&text, "  %d places age, worst first:\n", rows.size());
  absl::StrAppendFormat(&text, "  %8s %10s %10s %7s %8s %6s %9s %7s  %s\n", "place", "x", "y",
                        "found", "refused", "conf.", "disagreed", "lately", "last seen");
  for (std::size_t i = 0; i < std::min(rows.size(), kMaxPlacesInText); ++i) {
    const std::int32_t place = rows[i];
    text += RowText(place, use.places.at(place),
                    places[static_cast<std::size_t>(place)].T_map_place.translation());
  }
  if (rows.size() > kMaxPlacesInText) {
    absl::StrAppendFormat(&text, "  and %d more: --json tells all\n",
                          rows.size() - kMaxPlacesInText);
  }
  return text;
}

}  // namespace scanloc::report
