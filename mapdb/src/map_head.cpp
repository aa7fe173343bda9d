#include "map_head.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/geo_origin.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxSchemaRows = 100;
constexpr std::size_t kMaxParams = 10'000;

struct SchemaRow {
  std::string type;
  std::string name;
  std::string sql;
};

absl::Status SchemaError(const Connection& connection, absl::string_view what) {
  return DamagedError(connection.path(), absl::StrCat("its schema is not that of a map: ", what));
}

absl::StatusOr<std::vector<SchemaRow>> ReadSchema(Connection& connection) {
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectSchema));
  std::vector<SchemaRow> schema;
  while (true) {
    ASSIGN_OR_RETURN(const bool row, rows.Step());
    if (!row) return schema;
    if (schema.size() == kMaxSchemaRows) {
      return SchemaError(connection, absl::StrCat("it has more than ", kMaxSchemaRows, " entries"));
    }
    schema.push_back(
        {std::string(rows.Text(0)), std::string(rows.Text(1)), std::string(rows.Text(2))});
  }
}

const schema::Table* FindTable(const SchemaRow& row, int version) {
  const auto* const table = std::find_if(
      schema::kTables.begin(), schema::kTables.end(),
      [&](const schema::Table& known) { return known.IsOf(version) && known.name == row.name; });
  return table != schema::kTables.end() && row.type == "table" && row.sql == table->create_sql
             ? table
             : nullptr;
}

// Whatever else a database may hold (views, triggers, generated columns) never gets to run: until
// this has been seen no statement touches a table. Those that tell the version are of one shape in
// all versions; a newer one whose files we can read may have added tables.
absl::Status CheckSchema(const Connection& connection, const std::vector<SchemaRow>& schema,
                         MapHead& head) {
  const int version = head.schema_version;
  const bool is_newer = version > schema::kVersion;
  std::ptrdiff_t num_found = 0;
  for (const SchemaRow& row : schema) {
    if (FindTable(row, version) != nullptr) {
      ++num_found;
      continue;
    }
    const bool is_ours = std::any_of(
        schema::kTables.begin(), schema::kTables.end(),
        [&](const schema::Table& known) { return absl::EqualsIgnoreCase(known.name, row.name); });
    if (!is_newer || is_ours || row.type != "table") {
      return SchemaError(connection, absl::StrCat("at '", row.name, "'"));
    }
  }
  const auto num_expected =
      std::count_if(schema::kTables.begin(), schema::kTables.end(),
                    [&](const schema::Table& table) { return table.IsOf(version); });
  if (num_found != num_expected) return SchemaError(connection, "a table is missing");
  head.has_additions = static_cast<std::ptrdiff_t>(schema.size()) > num_found;
  return absl::OkStatus();
}

// Every name is read only once its checksum holds, so that damage never looks like a newer file.
absl::StatusOr<std::map<std::string, std::string>> ReadMeta(Connection& connection) {
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectMeta));
  std::map<std::string, std::string> meta;
  while (true) {
    ASSIGN_OR_RETURN(const bool row, rows.Step());
    if (!row) return meta;
    const std::string key(rows.Text(0));
    const std::string value(rows.Text(1));
    if (MetaChecksum(key, value) != rows.Int(2) || !meta.emplace(key, value).second) {
      return DamagedError(connection.path(), "meta: a checksum does not match");
    }
  }
}

absl::StatusOr<int> ReadVersion(const std::map<std::string, std::string>& meta, const char* key,
                                const std::string& path) {
  const auto entry = meta.find(key);
  int version = 0;
  if (entry != meta.end()) {
    const std::string& text = entry->second;
    std::from_chars(text.data(), text.data() + text.size(), version);
  }
  if (version < 1) return DamagedError(path, absl::StrCat("meta: no valid ", key));
  return version;
}

absl::Status ReadVersions(Connection& connection, const std::vector<SchemaRow>& schema,
                          MapHead& head) {
  const bool has_meta = std::ranges::any_of(schema, [](const SchemaRow& row) {
    const schema::Table* table = FindTable(row, 1);
    return table != nullptr && table->name == std::string_view(schema::kMetaTable);
  });
  if (!has_meta) return SchemaError(connection, "it has no such table 'meta' as maps have");
  ASSIGN_OR_RETURN(const auto meta, ReadMeta(connection));
  const std::string& path = connection.path();
  ASSIGN_OR_RETURN(const int version, ReadVersion(meta, schema::kVersionKey, path));
  ASSIGN_OR_RETURN(const int compatible, ReadVersion(meta, schema::kCompatibleVersionKey, path));
  if (compatible > schema::kVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", path, "' has schema version ", version, ", which needs a reader of ",
                     compatible, " or newer; this one reads up to ", schema::kVersion,
                     ": use a newer scanloc, or build the map again with this one"));
  }
  if (!meta.contains(schema::kBuiltByKey) || !meta.contains(schema::kContentIdKey)) {
    return DamagedError(path, "meta: a key is missing");
  }
  head.schema_version = version;
  head.compatible_version = compatible;
  head.built_by = meta.at(schema::kBuiltByKey);
  head.content_id = meta.at(schema::kContentIdKey);
  if (const auto entry = meta.find(schema::kHistoryKey); entry != meta.end()) {
    absl::StatusOr<std::vector<HistoryEntry>> history = DecodeHistory(entry->second);
    if (!history.ok()) return DamagedError(path, history.status().message());
    head.history = *std::move(history);
  }
  if (const auto entry = meta.find(schema::kGeoOriginKey); entry != meta.end()) {
    const absl::StatusOr<GeoOrigin> origin = DecodeGeoOrigin(entry->second);
    if (!origin.ok()) return DamagedError(path, origin.status().message());
    head.geo_origin = *origin;
  }
  return absl::OkStatus();
}

absl::Status ReadParams(Connection& connection, MapHead& head) {
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectParams));
  while (true) {
    ASSIGN_OR_RETURN(const bool row, rows.Step());
    if (!row) break;
    if (head.param_texts.size() == kMaxParams) {
      return DamagedError(connection.path(), absl::StrCat("params: more than ", kMaxParams));
    }
    head.param_texts.emplace_back(rows.Text(0), rows.Text(1));
    const auto& [name, value] = head.param_texts.back();
    if (ParamChecksum(name, value) != rows.Int(2)) {
      return DamagedError(connection.path(), "params: a checksum does not match");
    }
  }
  absl::StatusOr<Params> params = DecodeParams(head.param_texts, head.schema_version);
  if (!params.ok()) return DamagedError(connection.path(), params.status().message());
  head.params = *std::move(params);
  if (head.schema_version == schema::kVersion && EncodeParams(head.params) != head.param_texts) {
    return DamagedError(connection.path(), "params: not the parameters of its version");
  }
  return absl::OkStatus();
}

absl::Status CheckSession(const SessionRow& session, bool is_last) {
  RETURN_IF_ERROR(CheckName("the session", session.name));
  for (const std::int64_t count :
       {session.num_scans, session.num_places, session.num_empty, session.num_unreadable}) {
    if (count < 0 || count > limits::kMaxPlaces) {
      return absl::InvalidArgumentError(absl::StrCat("it counts ", count, " scans"));
    }
  }
  if (session.num_done() > session.num_scans ||
      (!is_last && session.num_done() < session.num_scans)) {
    return absl::InvalidArgumentError(
        absl::StrCat("it has ", session.num_done(), " of ", session.num_scans, " scans"));
  }
  return absl::OkStatus();
}

absl::Status ReadSessions(Connection& connection, MapHead& head) {
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectSessions));
  const std::string& path = connection.path();
  while (true) {
    ASSIGN_OR_RETURN(const bool row, rows.Step());
    if (!row) break;
    const auto id = static_cast<std::int64_t>(head.sessions.size());
    SessionRow session{std::string(rows.Text(1)),
                       std::string(rows.Text(2)),
                       rows.Int(3),
                       rows.Int(4),
                       rows.Int(5),
                       rows.Int(6)};
    if (rows.Int(0) != id || SessionChecksum(id, session) != rows.Int(7)) {
      return DamagedError(path, absl::StrCat("session ", id, ": its checksum does not match"));
    }
    if (id >= limits::kMaxSessions) {
      return absl::ResourceExhaustedError(
          absl::StrCat("map '", path, "' has more than ", limits::kMaxSessions, " sessions"));
    }
    head.sessions.push_back(std::move(session));
  }
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < head.sessions.size(); ++i) {
    const SessionRow& session = head.sessions[i];
    absl::Status status = CheckSession(session, i + 1 == head.sessions.size());
    if (status.ok() && !names.insert(session.name).second) {
      status = absl::InvalidArgumentError("an earlier one has its name");
    }
    if (!status.ok()) {
      return DamagedError(path, absl::StrCat("session ", i, ": ", status.message()));
    }
  }
  if (head.sessions.empty()) return DamagedError(path, "it has no session");
  if (head.num_places() > limits::kMaxPlaces) {
    return absl::ResourceExhaustedError(absl::StrCat("map '", path, "' has ", head.num_places(),
                                                     " places; the most is ", limits::kMaxPlaces));
  }
  return absl::OkStatus();
}

}  // namespace

std::int64_t MapHead::num_places() const {
  std::int64_t sum = 0;
  for (const SessionRow& session : sessions) sum += session.num_places;
  return sum;
}

absl::StatusOr<MapHead> ReadVersions(Connection& connection) {
  ASSIGN_OR_RETURN(const std::vector<SchemaRow> schema, ReadSchema(connection));
  MapHead head;
  absl::Status status = ReadVersions(connection, schema, head);
  if (status.ok()) status = CheckSchema(connection, schema, head);
  if (!status.ok()) return status;
  return head;
}

absl::Status ReadTables(Connection& connection, MapHead& head) {
  RETURN_IF_ERROR(ReadParams(connection, head));
  return ReadSessions(connection, head);
}

absl::StatusOr<MapHead> ReadHead(Connection& connection) {
  absl::StatusOr<MapHead> head = ReadVersions(connection);
  if (!head.ok()) return head;
  RETURN_IF_ERROR(ReadTables(connection, *head));
  return head;
}

absl::Status CheckRoomForPlaces(Connection& connection, const MapHead& head) {
  std::int64_t place_bytes = kPoseBytes;
  for (const ContextShape& shape : ContextShapes(head.params)) {
    place_bytes += static_cast<std::int64_t>(
        MaskBytes(shape.num_cells()) + sizeof(std::int32_t) * (shape.num_rows + shape.num_cols));
  }
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, connection.FileBytes());
  if (head.num_places() > file_bytes / place_bytes) {
    return DamagedError(
        connection.path(),
        absl::StrCat("it has ", file_bytes, " bytes, too few for ", head.num_places(), " places"));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::mapdb
