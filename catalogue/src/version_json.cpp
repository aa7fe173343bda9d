#include "version_json.hpp"

#include "absl/strings/str_cat.h"
#include "scanloc/catalogue/version_file.hpp"
#include "text_file.hpp"

namespace scanloc::catalogue {

nlohmann::json ToJson(const Version& version) {
  const Area& area = version.area;
  return {{"region", version.region},
          {"content_id", version.content_id},
          {"sha256", version.sha256},
          {"num_bytes", version.num_bytes},
          {"num_places", version.num_places},
          {"area", {area.min_x_m, area.min_y_m, area.max_x_m, area.max_y_m}},
          {"published_by", version.published_by},
          {"published_ms", version.published_ms}};
}

absl::StatusOr<Version> FromJson(const nlohmann::json& json) {
  try {
    Version version{.region = json.at("region"),
                    .content_id = json.at("content_id"),
                    .sha256 = json.at("sha256"),
                    .num_bytes = json.at("num_bytes"),
                    .num_places = json.at("num_places"),
                    .area = {},
                    .published_by = json.at("published_by"),
                    .published_ms = json.at("published_ms")};
    const nlohmann::json& area = json.at("area");
    version.area = {area.at(0), area.at(1), area.at(2), area.at(3)};
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
  const absl::StatusOr<std::string> text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  std::vector<Version> versions;
  if (text->empty()) return versions;
  const nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_array()) return absl::DataLossError(absl::StrCat("'", path, "' holds no versions"));
  for (const nlohmann::json& entry : json) {
    absl::StatusOr<Version> version = FromJson(entry);
    if (!version.ok()) return version.status();
    versions.push_back(*std::move(version));
  }
  return versions;
}

}  // namespace scanloc::catalogue
