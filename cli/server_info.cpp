#include "cli/server_info.hpp"

#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/geo_options.hpp"
#include "cli/map_text.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/map_state.hpp"
#include "scanloc/report/answer_json.hpp"
#include "scanloc/report/map_use_text.hpp"

namespace scanloc::cli {
namespace {

std::string ListAsText(const std::vector<MapSummary>& maps) {
  if (maps.empty()) return "no maps\n";
  std::string text =
      absl::StrFormat("%-24s %-8s %10s  %s\n", "map", "state", "places", "content id");
  for (const MapSummary& map : maps) {
    const bool is_serving = map.state == MapState::kServing;
    absl::StrAppendFormat(&text, "%-24s %-8s %10s  %s\n", Printable(map.name), StateName(map.state),
                          is_serving ? absl::StrCat(map.num_places) : "-",
                          is_serving ? Printable(map.content_id) : "-");
  }
  return text;
}

report::Json ListToJson(const std::vector<MapSummary>& maps) {
  report::Json json{{"maps", report::Json::array()}};
  for (const MapSummary& map : maps) {
    report::Json line{{"name", map.name}, {"state", StateName(map.state)}};
    if (map.state == MapState::kServing) {
      line["content_id"] = map.content_id;
      line["num_places"] = map.num_places;
      line["generation"] = map.generation;
    }
    json["maps"].push_back(std::move(line));
  }
  return json;
}

Eigen::AlignedBox3d BoxOf(const MapInfo& info) {
  return info.extent ? Eigen::AlignedBox3d(info.extent->min_m, info.extent->max_m)
                     : Eigen::AlignedBox3d();
}

report::Json InfoToJson(const MapInfo& info) {
  report::Json json;
  json["name"] = info.name;
  json["content_id"] = info.content_id;
  json["generation"] = info.generation;
  json["num_places"] = info.num_places;
  json["sessions"] = report::Json::array();
  for (const std::string& session : info.sessions) json["sessions"].push_back({{"name", session}});
  json["params"] = ParamsToJson(info.params);
  json["extent"] = ExtentToJson(BoxOf(info));
  if (info.geo_origin) json["geo_origin"] = report::GeoToJson(*info.geo_origin);
  return json;
}

std::string InfoAsText(const MapInfo& info) {
  std::string text = absl::StrFormat(
      "%s\n"
      "  content id      %s\n"
      "  put in service  %d times\n"
      "  places          %d\n",
      Printable(info.name), Printable(info.content_id), info.generation, info.num_places);
  absl::StrAppend(&text, ExtentAsText(BoxOf(info)));
  if (info.geo_origin) {
    absl::StrAppend(&text, "  on earth        ", GeoOriginAsText(*info.geo_origin), "\n");
  }
  absl::StrAppend(&text, "sessions\n");
  for (const std::string& session : info.sessions) {
    absl::StrAppend(&text, "  ", Printable(session), "\n");
  }
  return absl::StrCat(text, ParamsAsText(info.params));
}

}  // namespace

absl::StatusOr<std::string> TellOfServer(const Connection& server, const std::string& name,
                                         bool as_json) {
  ASSIGN_OR_RETURN(const auto client, Connect(server));
  if (name.empty()) {
    ASSIGN_OR_RETURN(const auto maps, client.ListMaps());
    return as_json ? report::ToText(ListToJson(maps)) : ListAsText(maps);
  }
  ASSIGN_OR_RETURN(const auto info, client.GetMapInfo(name));
  return as_json ? report::ToText(InfoToJson(info)) : InfoAsText(info);
}

absl::StatusOr<std::string> TellHealthOnServer(const Connection& server, const std::string& name,
                                               bool as_json) {
  ASSIGN_OR_RETURN(const auto client, Connect(server));
  ASSIGN_OR_RETURN(const auto use, client.GetMapUse(name));
  if (as_json) return report::ToText(report::MapUseToJson(use));
  std::vector<Place> places;
  std::string token;
  do {
    ASSIGN_OR_RETURN(const auto page, client.ListPlaces(name, token));
    places.insert(places.end(), page.places.begin(), page.places.end());
    token = page.next_page_token;
  } while (!token.empty());
  return report::MapUseAsText(use, places);
}

}  // namespace scanloc::cli
