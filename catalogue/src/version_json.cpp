#include "version_json.hpp"

#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/catalogue/version_file.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text_file.hpp"

namespace scanloc::catalogue {

namespace {

/// Those of before polygons have a box of the map frame.
Area AreaOf(const nlohmann::json& json) {
  Area area{.corners = {}, .is_on_earth = json.value("on_earth", false)};
  if (!json.contains("corners")) {
    const nlohmann::json& box = json.at("area");
    area.corners = CornersOf({box.at(0), box.at(1), box.at(2), box.at(3)});
  } else {
    for (const nlohmann::json& corner : json.at("corners")) {
      area.corners.push_back({corner.at(0), corner.at(1)});
    }
  }
  return area;
}

}  // namespace

nlohmann::json ToJson(const Version& version) {
  // Programs that know of no polygons read the box.
  const Box box = BoxOf(version.area);
  nlohmann::json corners = nlohmann::json::array();
  for (const Corner& corner : version.area.corners) corners.push_back({corner.x, corner.y});
  return {{"region", version.region},
          {"content_id", version.content_id},
          {"sha256", version.sha256},
          {"num_bytes", version.num_bytes},
          {"num_places", version.num_places},
          {"area", {box.min_x, box.min_y, box.max_x, box.max_y}},
          {"corners", std::move(corners)},
          {"on_earth", version.area.is_on_earth},
          {"published_by", version.published_by},
          {"published_ms", version.published_ms}};
}

absl::StatusOr<Version> FromJson(const nlohmann::json& json) {
  try {
    Version version;
    json.at("region").get_to(version.region);
    json.at("content_id").get_to(version.content_id);
    json.at("sha256").get_to(version.sha256);
    json.at("num_bytes").get_to(version.num_bytes);
    json.at("num_places").get_to(version.num_places);
    json.at("published_by").get_to(version.published_by);
    json.at("published_ms").get_to(version.published_ms);
    version.area = AreaOf(json);
    if (absl::Status status = Validate(version); !status.ok()) {
      return absl::DataLossError(status.message());
    }
    return version;
  } catch (const nlohmann::json::exception& error) {
    return absl::DataLossError(absl::StrCat("it holds no version of a map: ", error.what()));
  }
}

absl::Status WriteVersions(const std::string& path, const std::vector<Version>& versions) {
  nlohmann::json json = nlohmann::json::array();
  for (const Version& version : versions) json.push_back(ToJson(version));
  return WriteTextFile(path, json.dump(1));
}

absl::StatusOr<std::vector<Version>> ReadVersions(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path));
  std::vector<Version> versions;
  if (text.empty()) return versions;
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_array()) return absl::DataLossError(absl::StrCat("'", path, "' holds no versions"));
  for (const nlohmann::json& entry : json) {
    ASSIGN_OR_RETURN(Version version, FromJson(entry));
    versions.push_back(std::move(version));
  }
  return versions;
}

}  // namespace scanloc::catalogue
