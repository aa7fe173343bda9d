#include "scanloc/mapdb/map_file.hpp"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "calibration_rows.hpp"
#include "checksum.hpp"
#include "encoding.hpp"
#include "map_rows.hpp"
#include "open_map.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {
namespace {

// An open map whose head is read and whose size fits the head.
struct OpenMap {
  Connection connection;
  MapHead head;
};

absl::StatusOr<OpenMap> OpenAndReadHead(const std::string& path) {
  absl::StatusOr<Connection> connection = OpenForReading(path);
  if (!connection.ok()) return connection.status();
  absl::StatusOr<MapHead> head = ReadHead(*connection);
  if (!head.ok()) return head.status();
  if (absl::Status status = CheckRoomForPlaces(*connection, *head); !status.ok()) return status;
  return OpenMap{*std::move(connection), *std::move(head)};
}

template <typename Visitor>
absl::Status VisitPlacesOf(OpenMap& map, Visitor&& visit) {
  return VisitPlaces(map.connection, map.head, std::forward<Visitor>(visit)).status();
}

Place PlaceOf(const PlaceRow& row) {
  return {DecodePose(row.pose), row.stamp_ns, static_cast<std::int32_t>(row.session)};
}

void AppendContext(std::int32_t place, const ContextShape& shape, const ContextValues& values,
                   Map& map) {
  const bool is_polar = shape.kind == DescriptorKind::kPolar;
  ContextTable& table = is_polar ? map.polar : map.cart;
  table.Append({place, static_cast<float>(shape.root_shift_m), false, shape.variant > 0},
               values.cells_cm, values.retrieval_cm, values.aligning_cm);
  if (!is_polar && map.params.cart.double_flip) table.AppendFlipOfLast();
}

void ReserveFor(std::size_t num_places, Map& map) {
  map.places.reserve(num_places);
  if (map.params.structure.enabled) map.structures.reserve(num_places);
  if (map.params.polar.enabled) {
    map.polar.Reserve(num_places * (1 + map.params.polar.root_shifts_m.size()));
  }
  if (map.params.cart.enabled) {
    map.cart.Reserve(num_places * (map.params.cart.double_flip ? 2 : 1));
  }
}

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
  absl::StatusOr<OpenMap> file = OpenAndReadHead(path);
  if (!file.ok()) return file.status();
  Map map = MakeEmptyMap(file->head.params);
  map.content_id = file->head.content_id;
  map.complete = file->head.complete();
  for (const SessionRow& session : file->head.sessions) map.sessions.push_back(session.name);
  ReserveFor(static_cast<std::size_t>(file->head.num_places()), map);

  absl::StatusOr<DescriptorReader> descriptors =
      DescriptorReader::Open(file->connection, file->head);
  if (!descriptors.ok()) return descriptors.status();
  absl::Status status = VisitPlacesOf(*file, [&](const PlaceRow& row) {
    map.places.push_back(PlaceOf(row));
    absl::Status read =
        descriptors->Read(row, [&](const ContextShape& shape, const ContextValues& context) {
          AppendContext(static_cast<std::int32_t>(row.id), shape, context, map);
        });
    if (read.ok() && descriptors->has_structures()) {
      map.structures.push_back(descriptors->structure());
    }
    return read;
  });
  status.Update(status.ok() ? descriptors->CheckEnd() : absl::OkStatus());
  if (!status.ok()) return status;
  absl::StatusOr<std::optional<StoredCalibration>> stored =
      ReadCalibration(file->connection, file->head);
  if (!stored.ok()) return stored.status();
  if (stored->has_value()) {
    map.calibration_id = CalibrationId((*stored)->calibration, (*stored)->confusable);
    map.calibration = (*stored)->calibration;
    map.confusable = std::move((*stored)->confusable);
  }
  return map;
}

absl::StatusOr<MapInfo> ReadInfo(const std::string& path) {
  absl::StatusOr<OpenMap> file = OpenAndReadHead(path);
  if (!file.ok()) return file.status();
  const absl::StatusOr<std::int64_t> file_bytes = file->connection.FileBytes();
  if (!file_bytes.ok()) return file_bytes.status();

  MapInfo info;
  info.schema_version = file->head.schema_version;
  info.compatible_version = file->head.compatible_version;
  info.built_by = file->head.built_by;
  info.history = file->head.history;
  info.content_id = file->head.content_id;
  info.complete = file->head.complete();
  info.params = file->head.params;
  info.file_bytes = *file_bytes;
  for (const SessionRow& row : file->head.sessions) {
    info.sessions.push_back(InfoOf(row));
    info.num_scans += row.num_scans;
    info.num_places += row.num_places;
    info.num_empty += row.num_empty;
    info.num_unreadable += row.num_unreadable;
  }
  absl::StatusOr<std::optional<StoredCalibration>> stored =
      ReadCalibration(file->connection, file->head);
  if (!stored.ok()) return stored.status();
  if (stored->has_value()) {
    info.calibration_id = CalibrationId((*stored)->calibration, (*stored)->confusable);
    info.calibration = (*stored)->calibration;
    info.confusable = std::move((*stored)->confusable);
  }
  std::int64_t last_session = -1;
  absl::Status status = VisitPlacesOf(*file, [&](const PlaceRow& row) {
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
  absl::StatusOr<OpenMap> file = OpenAndReadHead(path);
  if (!file.ok()) return file.status();
  std::vector<PlaceRecord> places;
  places.reserve(static_cast<std::size_t>(file->head.num_places()));
  absl::Status status = VisitPlacesOf(*file, [&](const PlaceRow& row) {
    places.push_back({PlaceOf(row), row.scan, static_cast<std::uint32_t>(row.num_voxels)});
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return places;
}

}  // namespace scanloc::mapdb
