#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {

/// Of the files of a folder of maps.
inline constexpr char kMapEnding[] = ".scanloc";

/// Which file each name stands for: the maps that were configured, and the files *.scanloc of one
/// folder, named as they are without the ending. A configured name goes before a file's.
/// Immutable.
class MapSources {
 public:
  MapSources(std::vector<MapSource> configured, std::string folder);

  /// All that there is now, configured ones first, then the folder's by name. NotFound: the folder
  /// cannot be read.
  [[nodiscard]] absl::StatusOr<std::vector<MapSource>> List() const;

  /// NotFound: neither configured nor in the folder, or no name at all.
  [[nodiscard]] absl::StatusOr<MapSource> Find(const std::string& name) const;

 private:
  const std::vector<MapSource> configured_;
  const std::string folder_;  // empty: none
};

}  // namespace scanloc::server
