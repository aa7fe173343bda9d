#include "maps/map_sources.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/printable.hpp"

namespace scanloc::server {

MapSources::MapSources(std::vector<MapSource> configured, std::string folder)
    : configured_(std::move(configured)), folder_(std::move(folder)) {}

absl::StatusOr<std::vector<MapSource>> MapSources::List() const {
  std::vector<MapSource> sources = configured_;
  if (folder_.empty()) return sources;
  std::vector<MapSource> found;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    const std::string name = path.stem().string();
    const bool is_known =
        std::ranges::any_of(configured_, [&](const MapSource& map) { return map.name == name; });
    if (path.extension() != kMapEnding || is_known) continue;
    if (const absl::Status status = CheckMapName(name); !status.ok()) {
      spdlog::warn("{} is not served: {}", Printable(path.string()),
                   Printable(std::string(status.message())));
      continue;
    }
    found.push_back({.name = name, .path = path.string()});
  }
  if (error) {
    return absl::NotFoundError(
        absl::StrCat("the maps folder ", folder_, " cannot be read: ", error.message()));
  }
  std::ranges::sort(found, {}, &MapSource::name);
  sources.insert(sources.end(), found.begin(), found.end());
  return sources;
}

absl::StatusOr<MapSource> MapSources::Find(const std::string& name) const {
  for (const MapSource& source : configured_) {
    if (source.name == name) return source;
  }
  // A name has no '/', so that nothing outside the folder can be meant.
  if (!folder_.empty() && CheckMapName(name).ok()) {
    const std::filesystem::path path = std::filesystem::path(folder_) / (name + kMapEnding);
    std::error_code error;
    if (std::filesystem::exists(path, error)) return MapSource{.name = name, .path = path.string()};
  }
  return absl::NotFoundError(
      absl::StrCat("no map is configured as ", absl::Utf8SafeCHexEscape(name)));
}

}  // namespace scanloc::server
