#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "cli/command.hpp"
#include "cli/half_built.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::cli {
namespace {

const char* ShiftModeName(ShiftMode mode) {
  return mode == ShiftMode::kBounded ? "bounded" : "circular";
}

report::Json ParamsToJson(const Params& params) {
  report::Json json = report::Json::object();
  VisitFields(params, [&](const char* name, const auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(field)>, ShiftMode>) {
      json[name] = ShiftModeName(field);
    } else {
      json[name] = field;
    }
  });
  return json;
}

report::Json PointToJson(const Eigen::Vector3d& p) {
  return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}};
}

std::string InfoAsJson(const mapdb::MapInfo& info) {
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
  json["params"] = ParamsToJson(info.params);
  json["extent"] = nullptr;
  if (!info.extent_m.isEmpty()) {
    json["extent"] = {{"min_m", PointToJson(info.extent_m.min())},
                      {"max_m", PointToJson(info.extent_m.max())}};
  }
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

struct FieldText {
  std::string operator()(bool field) const { return field ? "yes" : "no"; }
  std::string operator()(int field) const { return absl::StrCat(field); }
  std::string operator()(double field) const { return absl::StrCat(field); }
  std::string operator()(ShiftMode field) const { return ShiftModeName(field); }
  std::string operator()(const std::vector<double>& field) const {
    return field.empty() ? "none" : absl::StrJoin(field, ", ");
  }
};

constexpr std::size_t kMaxPairsInText = 10;

std::string CalibrationAsText(const mapdb::MapInfo& info) {
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

/// All parameters but those of auto that are as its scale has them.
std::string ParamsAsText(const Params& params) {
  Params usual = params;
  usual.automatic = AutoParamsAtScale(params.automatic.scale);
  std::set<std::pair<std::string, std::string>> unsaid;
  VisitAutoFields(usual.automatic,
                  [&](const char* name, auto field, auto /*least*/, auto /*most*/) {
                    unsaid.emplace(name, FieldText()(field));
                  });
  unsaid.erase({"auto.scale", FieldText()(params.automatic.scale)});
  std::string text = "parameters (--json: those of auto that its scale sets, too)\n";
  VisitFields(params, [&](const char* name, const auto& field) {
    const std::string value = FieldText()(field);
    if (!unsaid.contains({name, value})) absl::StrAppendFormat(&text, "  %-22s  %s\n", name, value);
  });
  return text;
}

std::string InfoAsText(const std::string& path, const mapdb::MapInfo& info) {
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
  if (!info.extent_m.isEmpty()) {
    const Eigen::Vector3d& low = info.extent_m.min();
    const Eigen::Vector3d& high = info.extent_m.max();
    absl::StrAppendFormat(
        &text, "  extent          x %.1f to %.1f m, y %.1f to %.1f m, z %.1f to %.1f m\n", low.x(),
        high.x(), low.y(), high.y(), low.z(), high.z());
  }
  absl::StrAppend(&text, "sessions\n");
  for (const mapdb::SessionInfo& session : info.sessions) {
    absl::StrAppendFormat(&text, "  %s: %d places of %d scans, %d empty, %d unreadable%s\n",
                          Printable(session.name), session.num_places, session.num_scans,
                          session.num_empty, session.num_unreadable,
                          session.complete() ? "" : "; unfinished");
  }
  absl::StrAppend(&text, CalibrationAsText(info), ParamsAsText(info.params));
  return text;
}

class InfoCommand : public Command {
 public:
  [[nodiscard]] std::string name() const override { return "info"; }
  [[nodiscard]] std::string summary() const override { return "Say what is in a map file"; }
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_flag("--json", json_, "One JSON document");
    app.footer(
        "Examples:\n"
        "  scanloc info town.scanloc\n"
        "  scanloc info town.scanloc --json | jq .num_places");
  }
  [[nodiscard]] absl::Status Run() override {
    const absl::StatusOr<mapdb::MapInfo> info = mapdb::ReadInfo(map_);
    if (!info.ok()) return info.status();
    return WriteText("-", json_ ? InfoAsJson(*info) : InfoAsText(map_, *info));
  }

 private:
  std::string map_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeInfoCommand() { return std::make_unique<InfoCommand>(); }

}  // namespace scanloc::cli
