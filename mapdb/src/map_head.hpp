#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "checksum.hpp"
#include "encoding.hpp"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/history.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// The small tables of a map file.
struct MapHead {
  int schema_version = 0;
  int compatible_version = 0;
  std::string built_by;
  std::string content_id;
  std::vector<HistoryEntry> history;
  std::optional<GeoOrigin> geo_origin;
  ParamTexts param_texts;
  Params params;
  std::vector<SessionRow> sessions;
  bool has_additions = false;  ///< tables of a newer version, of which nothing is known

  [[nodiscard]] std::int64_t num_places() const;
  /// False: the last session has scans left to build. Only the last can have.
  [[nodiscard]] bool complete() const {
    return sessions.back().num_done() == sessions.back().num_scans;
  }
};

/// The first step of ReadHead: compares the schema and reads the versions. Before it has succeeded
/// no other statement may run, since what a hostile schema says would be executed.
[[nodiscard]] absl::StatusOr<MapHead> ReadVersions(Connection& connection);
/// The second: parameters and sessions.
[[nodiscard]] absl::Status ReadTables(Connection& connection, MapHead& head);

/// Checks the version and the schema and reads the small tables.
[[nodiscard]] absl::StatusOr<MapHead> ReadHead(Connection& connection);

/// OK if the file is large enough to hold as many places as its head says, so that memory set aside
/// for them is in proportion to the file.
[[nodiscard]] absl::Status CheckRoomForPlaces(Connection& connection, const MapHead& head);

}  // namespace scanloc::mapdb
