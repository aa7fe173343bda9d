#include "scanloc/mapdb/map_file.hpp"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "calibration_rows.hpp"
#include "checksum.hpp"
#include "encoding.hpp"
#include "file_payload.hpp"
#include "key_rows.hpp"
#include "map_rows.hpp"
#include "open_map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {
namespace {

// An open map whose head is read and whose size fits the head.
struct OpenMapFile {
  Connection connection;
  MapHead head;
};

absl::StatusOr<OpenMapFile> OpenAndReadHead(const std::string& path) {
  ASSIGN_OR_RETURN(Connection connection, OpenForReading(path));
  ASSIGN_OR_RETURN(MapHead head, ReadHead(connection));
  RETURN_IF_ERROR(CheckRoomForPlaces(connection, head));
  return OpenMapFile{std::move(connection), std::move(head)};
}

template <typename Visitor>
absl::Status VisitPlacesOf(OpenMapFile& map, Visitor&& visit) {
  return VisitPlaces(map.connection, map.head, std::forward<Visitor>(visit)).status();
}

Place PlaceOf(const PlaceRow& row) {
  return {DecodePose(row.pose), row.stamp_ns, static_cast<std::int32_t>(row.session)};
}

ContextTable& TableOf(DescriptorKind kind, Map& map) {
  return kind == DescriptorKind::kPolar ? map.polar : map.cart;
}

ContextTable::Entry EntryOf(std::int32_t place, const ContextShape& shape) {
  return {place, static_cast<float>(shape.root_shift_m), false, shape.variant > 0};
}

void AppendFlip(DescriptorKind kind, Map& map) {
  if (kind == DescriptorKind::kCart && map.params.cart.double_flip) map.cart.AppendFlipOfLast();
}

void AppendContext(std::int32_t place, const ContextShape& shape, const ContextValues& values,
                   Map& map) {
  TableOf(shape.kind, map)
      .Append(EntryOf(place, shape), values.cells_cm, values.retrieval_cm, values.aligning_cm);
  AppendFlip(shape.kind, map);
}

void ReserveFor(std::size_t num_places, bool with_contexts, Map& map) {
  map.places.reserve(num_places);
  if (map.params.structure.enabled) map.grounds.reserve(num_places);
  if (map.params.structure.enabled && with_contexts) map.structures.reserve(num_places);
  if (map.params.polar.enabled) {
    map.polar.Reserve(num_places * (1 + map.params.polar.root_shifts_m.size()), with_contexts);
  }
  if (map.params.cart.enabled) {
    map.cart.Reserve(num_places * (map.params.cart.double_flip ? 2 : 1), with_contexts);
  }
}

// A map as the head says it, with room for its places.
Map StartMap(const MapHead& head, bool with_contexts) {
  Map map = MakeEmptyMap(head.params);
  map.content_id = head.content_id;
  map.complete = head.complete();
  map.geo_origin = head.geo_origin;
  for (const SessionRow& session : head.sessions) map.sessions.push_back(session.name);
  ReserveFor(static_cast<std::size_t>(head.num_places()), with_contexts, map);
  return map;
}

absl::Status AddCalibration(OpenMapFile& file, Map& map) {
  absl::StatusOr<std::optional<StoredCalibration>> stored =
      ReadCalibration(file.connection, file.head);
  if (!stored.ok() || !stored->has_value()) return stored.status();
  map.calibration_id = CalibrationId((*stored)->calibration, (*stored)->confusable);
  map.calibration = (*stored)->calibration;
  map.confusable = std::move((*stored)->confusable);
  return absl::OkStatus();
}

// Reads the keys and bearings of place after place beside the rows of `places`.
class KeysLoader {
 public:
  static absl::StatusOr<KeysLoader> Open(Connection& connection, const MapHead& head,
                                         const Map* before, Map& map) {
    ASSIGN_OR_RETURN(KeysCursor keys, KeysCursor::Open(connection, head));
    KeysLoader loader(std::move(keys), connection.path(), before, map);
    if (!map.params.structure.enabled) return loader;
    ASSIGN_OR_RETURN(loader.bearings_, BearingsCursor::Open(connection, head));
    return loader;
  }

  absl::Status Add(const PlaceRow& row) {
    ASSIGN_OR_RETURN(const bool has_row, cursor_.Step());
    if (!has_row) return DamagedError(path_, "keys are missing at its end");
    RETURN_IF_ERROR(cursor_.Read(keys_));
    StartPlaceChecksum(row, hasher_);
    for (const std::int64_t checksum : keys_.checksums) {
      hasher_.Add(checksum);
      expected_.checksums.push_back(static_cast<std::uint32_t>(checksum));
    }
    if (hasher_.Digest64() != row.checksum) {
      return DamagedError(path_, absl::StrCat("place ", row.id, ": its checksum does not match"));
    }
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      TableOf(shapes_[i].kind, map_)
          .AppendKey(EntryOf(static_cast<std::int32_t>(row.id), shapes_[i]), keys_.retrieval_cm[i]);
      AppendFlip(shapes_[i].kind, map_);
    }
    if (bearings_.has_value()) {
      map_.grounds.push_back(keys_.ground);
      RETURN_IF_ERROR(AddBearings());
    }
    if (before_ != nullptr) map_.ShareWith(*before_);
    return absl::OkStatus();
  }

  absl::StatusOr<ExpectedRows> Finish() {
    ASSIGN_OR_RETURN(const bool has_row, cursor_.Step());
    if (has_row) return DamagedError(path_, "it has more keys than its places need");
    if (!bearings_.has_value()) return std::move(expected_);
    ASSIGN_OR_RETURN(const bool has_bearings, bearings_->Step());
    if (has_bearings) return DamagedError(path_, "it has more bearings than its places need");
    return std::move(expected_);
  }

 private:
  KeysLoader(KeysCursor cursor, std::string path, const Map* before, Map& map)
      : cursor_(std::move(cursor)),
        shapes_(ContextShapes(map.params)),
        path_(std::move(path)),
        before_(before),
        map_(map) {}

  absl::Status AddBearings() {
    ASSIGN_OR_RETURN(const bool has_row, bearings_->Step());
    if (!has_row) return DamagedError(path_, "bearings are missing at its end");
    const absl::StatusOr<BearingGrid> bearings = bearings_->Read();
    if (bearings.ok()) map_.bearings.push_back(*bearings);
    return bearings.status();
  }

  KeysCursor cursor_;
  std::optional<BearingsCursor> bearings_;  // where the map has structures
  std::vector<ContextShape> shapes_;
  std::string path_;
  const Map* before_;  // null: none
  Map& map_;
  PlaceKeys keys_;
  Hasher hasher_;
  ExpectedRows expected_;
};

SessionInfo InfoOf(const SessionRow& row) {
  SessionInfo info;
  info.name = row.name;
  info.num_scans = row.num_scans;
  info.num_places = row.num_places;
  info.num_empty = row.num_empty;
  info.num_unreadable = row.num_unreadable;
  return info;
}

void Widen(std::int64_t stamp_ns, bool is_first, std::int64_t& first_ns, std::int64_t& last_ns) {
  first_ns = is_first ? stamp_ns : std::min(first_ns, stamp_ns);
  last_ns = is_first ? stamp_ns : std::max(last_ns, stamp_ns);
}

}  // namespace

absl::StatusOr<Map> LoadMap(const std::string& path) {
  ASSIGN_OR_RETURN(OpenMapFile file, OpenAndReadHead(path));
  Map map = StartMap(file.head, true);
  ASSIGN_OR_RETURN(DescriptorReader descriptors,
                   DescriptorReader::Open(file.connection, file.head));
  absl::Status status = VisitPlacesOf(file, [&](const PlaceRow& row) {
    map.places.push_back(PlaceOf(row));
    absl::Status read =
        descriptors.Read(row, [&](const ContextShape& shape, const ContextValues& context) {
          AppendContext(static_cast<std::int32_t>(row.id), shape, context, map);
        });
    if (read.ok() && descriptors.has_structures()) map.AppendStructure(descriptors.structure());
    return read;
  });
  status.Update(status.ok() ? descriptors.CheckEnd() : absl::OkStatus());
  if (status.ok()) status = AddCalibration(file, map);
  if (!status.ok()) return status;
  return map;
}

absl::StatusOr<Map> OpenMap(const std::string& path, const OpenOptions& options) {
  ASSIGN_OR_RETURN(OpenMapFile file, OpenAndReadHead(path));
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, file.connection.FileBytes());
  if (file.head.schema_version < schema::kKeysVersion || file_bytes <= options.whole_bytes) {
    return LoadMap(path);
  }
  Map map = StartMap(file.head, false);
  ASSIGN_OR_RETURN(KeysLoader keys,
                   KeysLoader::Open(file.connection, file.head, options.before, map));
  absl::Status status = VisitPlacesOf(file, [&](const PlaceRow& row) {
    map.places.push_back(PlaceOf(row));
    return keys.Add(row);
  });
  if (!status.ok()) return status;
  ASSIGN_OR_RETURN(ExpectedRows expected, keys.Finish());
  if (status = AddCalibration(file, map); !status.ok()) return status;
  ASSIGN_OR_RETURN(map.payload, FilePayload::Open(path, file.head, std::move(expected), options));
  return map;
}

absl::StatusOr<FileInfo> ReadInfo(const std::string& path) {
  ASSIGN_OR_RETURN(OpenMapFile file, OpenAndReadHead(path));
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, file.connection.FileBytes());

  FileInfo info;
  info.schema_version = file.head.schema_version;
  info.compatible_version = file.head.compatible_version;
  info.built_by = file.head.built_by;
  info.history = file.head.history;
  info.geo_origin = file.head.geo_origin;
  info.content_id = file.head.content_id;
  info.complete = file.head.complete();
  info.params = file.head.params;
  info.file_bytes = file_bytes;
  for (const SessionRow& row : file.head.sessions) {
    info.sessions.push_back(InfoOf(row));
    info.num_scans += row.num_scans;
    info.num_places += row.num_places;
    info.num_empty += row.num_empty;
    info.num_unreadable += row.num_unreadable;
  }
  ASSIGN_OR_RETURN(std::optional<StoredCalibration> stored,
                   ReadCalibration(file.connection, file.head));
  if (stored.has_value()) {
    info.calibration_id = CalibrationId(stored->calibration, stored->confusable);
    info.calibration = stored->calibration;
    info.confusable = std::move(stored->confusable);
  }
  std::int64_t last_session = -1;
  absl::Status status = VisitPlacesOf(file, [&](const PlaceRow& row) {
    SessionInfo& session = info.sessions[static_cast<std::size_t>(row.session)];
    Widen(row.stamp_ns, row.session != last_session, session.first_stamp_ns, session.last_stamp_ns);
    Widen(row.stamp_ns, row.id == 0, info.first_stamp_ns, info.last_stamp_ns);
    info.extent_m.extend(DecodePose(row.pose).translation());
    last_session = row.session;
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return info;
}

absl::StatusOr<std::vector<PlaceRecord>> ReadPlaces(const std::string& path) {
  ASSIGN_OR_RETURN(OpenMapFile file, OpenAndReadHead(path));
  std::vector<PlaceRecord> places;
  places.reserve(static_cast<std::size_t>(file.head.num_places()));
  absl::Status status = VisitPlacesOf(file, [&](const PlaceRow& row) {
    places.push_back({PlaceOf(row), row.scan, static_cast<std::uint32_t>(row.num_voxels)});
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return places;
}

}  // namespace scanloc::mapdb
