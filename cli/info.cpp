#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "cli/command.hpp"
#include "cli/connection_options.hpp"
#include "cli/geo_options.hpp"
#include "cli/map_text.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/use_file.hpp"
#include "scanloc/proto/map_state.hpp"
#include "scanloc/report/answer_json.hpp"
#include "scanloc/report/json.hpp"
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

/// What a server tells of the map of this name, or of all its maps if the name is empty.
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

/// How a map of the server fared in use.
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

std::string InfoAsJson(const mapdb::FileInfo& info) {
  report::Json json;
  json["content_id"] = info.content_id;
  json["schema_version"] = info.schema_version;
  json["compatible_version"] = info.compatible_version;
  json["built_by"] = info.built_by;
  json["complete"] = info.complete;
  json["num_places"] = info.num_places;
  json["num_scans"] = info.num_scans;
  json["num_empty"] = info.num_empty;
  json["num_unreadable"] = info.num_unreadable;
  json["first_stamp_ns"] = info.first_stamp_ns;
  json["last_stamp_ns"] = info.last_stamp_ns;
  json["sessions"] = report::Json::array();
  for (const mapdb::SessionInfo& session : info.sessions) {
    json["sessions"].push_back({{"name", session.name},
                                {"complete", session.complete()},
                                {"num_places", session.num_places},
                                {"num_scans", session.num_scans},
                                {"num_empty", session.num_empty},
                                {"num_unreadable", session.num_unreadable},
                                {"first_stamp_ns", session.first_stamp_ns},
                                {"last_stamp_ns", session.last_stamp_ns}});
  }
  json["history"] = report::Json::array();
  for (const mapdb::HistoryEntry& entry : info.history) {
    json["history"].push_back(
        {{"when", entry.when}, {"command", entry.command}, {"parents", entry.parents}});
  }
  json["geo_origin"] = nullptr;
  if (info.geo_origin) json["geo_origin"] = report::GeoToJson(*info.geo_origin);
  json["params"] = ParamsToJson(info.params);
  json["extent"] = ExtentToJson(info.extent_m);
  json["file_bytes"] = info.file_bytes;
  json["calibration_id"] = info.calibration_id;
  json["calibration"] = nullptr;
  if (info.calibration.has_value()) {
    json["calibration"] = {{"num_trials", info.calibration->num_trials}};
  }
  json["confusable"] = report::Json::array();
  for (const ConfusablePair& pair : info.confusable) {
    json["confusable"].push_back(
        {{"place", pair.place}, {"lookalike", pair.lookalike}, {"confidence", pair.confidence}});
  }
  return report::ToText(json);
}

constexpr std::size_t kMaxPairsInText = 10;

std::string CalibrationAsText(const mapdb::FileInfo& info) {
  if (!info.params.structure.enabled) return "";
  if (!info.calibration.has_value()) {
    return "look-alikes\n  not looked for; scanloc build --resume does\n";
  }
  std::string text =
      absl::StrFormat("look-alikes\n  %d trials on its own places\n", info.calibration->num_trials);
  if (info.confusable.empty()) return text + "  no two distant places are taken for each other\n";
  absl::StrAppendFormat(&text, "  %d pairs of distant places look alike, worst first:\n",
                        info.confusable.size());
  for (std::size_t i = 0; i < std::min(info.confusable.size(), kMaxPairsInText); ++i) {
    const ConfusablePair& pair = info.confusable[i];
    absl::StrAppendFormat(&text,
                          "    without place %d its scan would be taken for place %d with "
                          "confidence %.2f\n",
                          pair.place, pair.lookalike, pair.confidence);
  }
  if (info.confusable.size() > kMaxPairsInText) {
    absl::StrAppendFormat(&text, "    and %d more: --json tells all\n",
                          info.confusable.size() - kMaxPairsInText);
  }
  return text;
}

std::string InfoAsText(const std::string& path, const mapdb::FileInfo& info) {
  std::string text = absl::StrFormat(
      "%s\n"
      "  content id      %s\n"
      "  calibration id  %s\n"
      "  complete        %s\n"
      "  places          %d of %d scans\n"
      "  size            %.1f MB\n"
      "  schema version  %d, readable from %d on; made by %s\n",
      Printable(path), info.content_id,
      info.calibration_id.empty() ? "none: not calibrated" : info.calibration_id,
      info.complete ? "yes" : absl::StrCat("no, ", HalfBuilt(info)), info.num_places,
      info.num_scans, static_cast<double>(info.file_bytes) / 1e6, info.schema_version,
      info.compatible_version, Printable(info.built_by));
  absl::StrAppend(&text, ExtentAsText(info.extent_m));
  if (info.geo_origin) {
    absl::StrAppend(&text, "  on earth        ", GeoOriginAsText(*info.geo_origin), "\n");
  }
  absl::StrAppend(&text, "sessions\n");
  for (const mapdb::SessionInfo& session : info.sessions) {
    absl::StrAppendFormat(&text, "  %s: %d places of %d scans, %d empty, %d unreadable%s\n",
                          Printable(session.name), session.num_places, session.num_scans,
                          session.num_empty, session.num_unreadable,
                          session.complete() ? "" : "; unfinished");
  }
  if (!info.history.empty()) absl::StrAppend(&text, "history, oldest first\n");
  for (const mapdb::HistoryEntry& entry : info.history) {
    absl::StrAppendFormat(&text, "  %s  %s\n    of %s\n", Printable(entry.when),
                          Printable(entry.command), Printable(absl::StrJoin(entry.parents, ", ")));
  }
  absl::StrAppend(&text, CalibrationAsText(info), ParamsAsText(info.params));
  return text;
}

absl::StatusOr<std::string> TellHealthOf(const std::string& map, bool as_json) {
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map));
  const std::string file = mapdb::UseFileOf(map);
  absl::StatusOr<MapUse> use = mapdb::ReadUse(file, info.num_places);
  if (absl::IsNotFound(use.status())) {
    return absl::NotFoundError(absl::StrCat(
        "no server has counted yet how '", map, "' fares: there is no '", file,
        "'; serve it with scanlocd from a folder that it may write to, or ask the server with "
        "--server and --map"));
  }
  if (!use.ok()) return use.status();
  if (use->content_id != info.content_id) {
    return absl::FailedPreconditionError(absl::StrCat(
        "'", file, "' is of a map with content id ", use->content_id, ", and this one has ",
        info.content_id, ": a server that serves it sets that aside and counts anew"));
  }
  if (as_json) return report::ToText(report::MapUseToJson(*use));
  ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(map));
  std::vector<Place> places;
  for (const mapdb::PlaceRecord& record : records) places.push_back(record.place);
  return report::MapUseAsText(*use, places);
}

class InfoCommand : public Command {
 public:
  InfoCommand() : Command("info", "Say what is in a map file, or what maps a server has") {}
  void Declare(CLI::App& app) override {
    CLI::Option* const file = app.add_option("MAP", map_, "Map file");
    CLI::Option* const server = DeclareConnection(app, "Through a server", &server_);
    file->excludes(server);
    app.add_option("--map", name_, "Name of one map of the server [the list of all]")
        ->needs(server)
        ->group("Through a server");
    app.add_flag("--health", health_,
                 "How the places fared in use, as a server counted it: from MAP.health beside the "
                 "map, or with --server and --map from the server");
    app.add_flag("--json", json_, "One JSON document");
    app.callback([this] {
      if (map_.empty() && server_.address.empty()) throw CLI::RequiredError("MAP or --server");
      if (health_ && map_.empty() && name_.empty()) {
        throw CLI::ValidationError("--health", "with --server it needs --map, too");
      }
    });
    app.footer(
        "Examples:\n"
        "  scanloc info town.scanloc\n"
        "  scanloc info town.scanloc --json | jq .num_places\n"
        "  scanloc info town.scanloc --health\n"
        "  scanloc info --server 127.0.0.1:50061\n"
        "  scanloc info --server 127.0.0.1:50061 --map town");
  }
  [[nodiscard]] absl::Status Run() override {
    if (health_) {
      const auto text = server_.address.empty() ? TellHealthOf(map_, json_)
                                                : TellHealthOnServer(server_, name_, json_);
      return text.ok() ? WriteText("-", *text) : text.status();
    }
    if (!server_.address.empty()) {
      const auto text = TellOfServer(server_, name_, json_);
      return text.ok() ? WriteText("-", *text) : text.status();
    }
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map_));
    return WriteText("-", json_ ? InfoAsJson(info) : InfoAsText(map_, info));
  }

 private:
  std::string map_;
  Connection server_;
  std::string name_;
  bool health_ = false;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeInfoCommand() { return std::make_unique<InfoCommand>(); }

}  // namespace scanloc::cli
