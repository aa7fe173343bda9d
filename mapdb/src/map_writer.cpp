#include "map_writer.hpp"

#include <utility>

#include "absl/strings/str_cat.h"
#include "open_map.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"
#include "session_plan.hpp"

namespace scanloc::mapdb {
namespace {

constexpr char kBuiltBy[] = "scanloc " SCANLOC_VERSION;

// Another writer holds its lock to its end, so waiting for it is in vain; a reader soon lets go.
constexpr int kOtherWriterTimeout_ms = 200;

}  // namespace

absl::StatusOr<MapWriter> MapWriter::Open(const std::string& path) {
  ASSIGN_OR_RETURN(Connection connection, OpenForWriting(path, Access::kWrite));
  MapWriter writer(std::move(connection));
  RETURN_IF_ERROR(writer.TakeLock());
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, writer.connection_.FileBytes());
  if (file_bytes > 0) {
    RETURN_IF_ERROR(writer.ReadExisting());
  }
  writer.connection_.LimitTime(std::nullopt);
  if (file_bytes == 0) return writer;
  RETURN_IF_ERROR(writer.PrepareInserts());
  return writer;
}

absl::Status MapWriter::TakeLock() {
  connection_.SetBusyTimeout(kOtherWriterTimeout_ms);
  RETURN_IF_ERROR(connection_.Execute(schema::kBeginWrite));
  ASSIGN_OR_RETURN(const std::int64_t version, connection_.QueryInt(schema::kDataVersion));
  if (data_version_.has_value() && version != *data_version_) {
    return absl::UnavailableError(absl::StrCat("map '", path(), "' was written by another build",
                                               " meanwhile; scanloc info tells what it holds now"));
  }
  data_version_ = version;
  return absl::OkStatus();
}

absl::Status MapWriter::ReadExisting() {
  RETURN_IF_ERROR(CheckFront(connection_));
  ASSIGN_OR_RETURN(head_, ReadHead(connection_));
  if (head_.schema_version > schema::kVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", path(), "' has schema version ", head_.schema_version,
                     "; this scanloc can read it but writes only version ", schema::kVersion,
                     ": use a newer scanloc"));
  }
  absl::StatusOr<ContentHasher> content =
      VisitPlaces(connection_, head_, [](const PlaceRow&) { return absl::OkStatus(); });
  if (!content.ok()) return content.status();
  content_ = *std::move(content);
  num_places_ = head_.num_places();
  return absl::OkStatus();
}

absl::StatusOr<std::vector<PlaceRow>> MapWriter::ReadLastSession() {
  std::vector<PlaceRow> places;
  const auto last = static_cast<std::int64_t>(head_.sessions.size()) - 1;
  const absl::StatusOr<ContentHasher> content =
      VisitPlaces(connection_, head_, [&](const PlaceRow& row) {
        if (row.session == last) places.push_back(row);
        return absl::OkStatus();
      });
  if (!content.ok()) return content.status();
  return places;
}

absl::Status MapWriter::InsertPairs(const char* sql, const ParamTexts& pairs,
                                    std::int64_t (*checksum)(std::string_view, std::string_view)) {
  ASSIGN_OR_RETURN(Statement insert, connection_.Prepare(sql));
  for (const auto& [key, value] : pairs) {
    RETURN_IF_ERROR(insert.RunWith(key, value, checksum(key, value)));
  }
  return absl::OkStatus();
}

absl::Status MapWriter::Initialize(const Params& params) {
  for (const schema::Table& table : schema::kTables) {
    if (!table.IsOf(schema::kVersion)) continue;
    RETURN_IF_ERROR(connection_.Execute(table.create_sql));
  }
  RETURN_IF_ERROR(connection_.Execute(schema::kSetApplicationId));
  head_.schema_version = schema::kVersion;
  head_.compatible_version = schema::kCompatibleVersion;
  head_.built_by = kBuiltBy;
  head_.params = params;
  head_.param_texts = EncodeParams(params);
  content_.emplace(head_.param_texts);
  head_.content_id = content_->ContentId();
  const ParamTexts meta = {
      {schema::kVersionKey, absl::StrCat(head_.schema_version)},
      {schema::kCompatibleVersionKey, absl::StrCat(head_.compatible_version)},
      {schema::kBuiltByKey, head_.built_by},
      {schema::kContentIdKey, head_.content_id},
  };
  RETURN_IF_ERROR(InsertPairs(schema::kInsertMeta, meta, MetaChecksum));
  RETURN_IF_ERROR(InsertPairs(schema::kInsertParam, head_.param_texts, ParamChecksum));
  return PrepareInserts();
}

absl::Status MapWriter::PrepareInserts() {
  shapes_ = ContextShapes(head_.params);
  contexts_.resize(shapes_.size());
  const int version = head_.schema_version;
  const bool has_structures = head_.params.structure.enabled;
  const struct {
    std::optional<Statement>& insert;
    const char* sql;
    bool has_table = true;
  } inserts[] = {
      {insert_place_, schema::kInsertPlace},
      {insert_context_, schema::kInsertContext},
      {insert_structure_, version < 3 ? schema::kInsertStructure2 : schema::kInsertStructure,
       has_structures},
      {insert_keys_, schema::kInsertKeys, version >= schema::kKeysVersion},
      {insert_bearings_, schema::kInsertBearings,
       has_structures && version >= schema::kBearingsVersion},
  };
  for (const auto& [insert, sql, has_table] : inserts) {
    if (!has_table) continue;
    ASSIGN_OR_RETURN(insert, connection_.Prepare(sql));
  }
  return absl::OkStatus();
}

absl::Status MapWriter::StartSession(const SessionPlan& plan) {
  // A commit writes the counts of the last session alone.
  RETURN_IF_ERROR(Commit());
  const auto id = static_cast<std::int64_t>(head_.sessions.size());
  if (id >= limits::kMaxSessions) {
    return absl::ResourceExhaustedError(
        absl::StrCat("map '", path(), "' has ", id,
                     " sessions, the most that a map may have; start another map"));
  }
  SessionRow row;
  row.name = plan.name;
  row.plan_hash = PlanHash(plan);
  row.num_scans = static_cast<std::int64_t>(plan.scans.size());
  ASSIGN_OR_RETURN(Statement insert, connection_.Prepare(schema::kInsertSession));
  RETURN_IF_ERROR(insert.RunWith(id, row.name, row.plan_hash, row.num_scans, row.num_places,
                                 row.num_empty, row.num_unreadable, SessionChecksum(id, row)));
  head_.sessions.push_back(std::move(row));
  content_->AddSessionsBefore(head_.sessions.size(), head_.sessions);
  has_changes_ = true;
  return Commit();
}

void MapWriter::EncodeDescriptor(const PlaceDescriptor& descriptor, PlaceRow& place) {
  StartPlaceChecksum(place, place_hasher_);
  keys_.Start(place.id);
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    const Context& context = shapes_[i].kind == DescriptorKind::kPolar
                                 ? descriptor.polar[static_cast<std::size_t>(shapes_[i].variant)]
                                 : descriptor.cart;
    const Keys keys = MakeKeys(context);
    auto& [retrieval_key, aligning_key, cells, row] = contexts_[i];
    EncodeKey(keys.retrieval_cm, retrieval_key);
    EncodeKey(keys.aligning_cm, aligning_key);
    EncodeCells(context.cells_cm, cells);
    row.id = place.id * static_cast<std::int64_t>(shapes_.size()) + static_cast<std::int64_t>(i);
    row.place = place.id;
    row.kind = static_cast<std::int64_t>(shapes_[i].kind);
    row.variant = shapes_[i].variant;
    row.retrieval_key = retrieval_key;
    row.aligning_key = aligning_key;
    row.cells = cells;
    row.checksum = ContextChecksum(row, context_hasher_);
    place_hasher_.Add(row.checksum);
    keys_.AddContext(row.retrieval_key, row.checksum);
  }
  if (head_.params.structure.enabled) {
    EncodeStructure(descriptor.structure, place.id);
    place_hasher_.Add(structure_.checksum);
    keys_.AddStructure(structure_, descriptor.structure.posts.size());
  }
  place.checksum = place_hasher_.Digest64();
}

void MapWriter::EncodeStructure(const Structure& structure, std::int64_t place) {
  EncodePosts(structure.posts, head_.schema_version, posts_);
  EncodeBearings(BearingsOf(structure.posts, head_.params), rings_);
  // SQLite keeps no sign of a zero; adding 0 takes it off.
  structure_ = {
      place, structure.roll_rad + 0.0, structure.pitch_rad + 0.0, structure.height_m + 0.0, posts_,
      0};
  structure_.checksum = StructureChecksum(structure_, context_hasher_);
}

absl::Status MapWriter::InsertPlace(const PlaceRow& place) {
  return insert_place_->RunWith(place.id, place.session, place.stamp_ns, std::span(place.pose),
                                place.scan, place.num_voxels, place.checksum);
}

absl::Status MapWriter::InsertContext(const ContextRow& context) {
  return insert_context_->RunWith(context.id, context.place, context.kind, context.variant,
                                  context.checksum, context.retrieval_key, context.aligning_key,
                                  context.cells);
}

absl::Status MapWriter::InsertStructure() {
  return insert_structure_->RunWith(structure_.place, structure_.roll_rad, structure_.pitch_rad,
                                    structure_.height_m, structure_.checksum, structure_.posts);
}

absl::Status MapWriter::InsertKeys(const KeysRow& row) {
  return insert_keys_->RunWith(row.place, row.roll_rad, row.pitch_rad, row.height_m, row.num_posts,
                               row.checksum, row.retrieval_keys, row.checksums);
}

absl::Status MapWriter::InsertBearings() {
  const BearingsRow row{.place = structure_.place, .rings = rings_};
  return insert_bearings_->RunWith(row.place, BearingsChecksum(row, context_hasher_), row.rings);
}

absl::Status MapWriter::AddPlace(const PlannedScan& scan, const PlaceDescriptor& descriptor) {
  if (num_places_ >= limits::kMaxPlaces) {
    return absl::ResourceExhaustedError(
        absl::StrCat("map '", path(), "' has ", num_places_,
                     " places, the most that a map may have; start another map"));
  }
  PlaceRow place;
  place.id = num_places_;
  place.session = static_cast<std::int64_t>(head_.sessions.size()) - 1;
  place.stamp_ns = scan.stamp_ns;
  place.pose = EncodePose(scan.T_map_place);
  place.scan = scan.name;
  place.num_voxels = descriptor.num_voxels;
  EncodeDescriptor(descriptor, place);
  RETURN_IF_ERROR(InsertPlace(place));
  for (const EncodedContext& context : contexts_) {
    RETURN_IF_ERROR(InsertContext(context.row));
  }
  if (insert_structure_.has_value()) {
    RETURN_IF_ERROR(InsertStructure());
  }
  if (insert_keys_.has_value()) {
    RETURN_IF_ERROR(InsertKeys(keys_.Finish()));
  }
  if (insert_bearings_.has_value()) {
    RETURN_IF_ERROR(InsertBearings());
  }
  content_->AddPlace(place);
  ++num_places_;
  ++head_.sessions.back().num_places;
  has_changes_ = true;
  return absl::OkStatus();
}

void MapWriter::AddSkipped(SkipReason reason) {
  SessionRow& session = head_.sessions.back();
  ++(reason == SkipReason::kEmpty ? session.num_empty : session.num_unreadable);
  has_changes_ = true;
}

absl::Status MapWriter::WriteCountsAndContentId() {
  const auto id = static_cast<std::int64_t>(head_.sessions.size()) - 1;
  const SessionRow& session = head_.sessions.back();
  ASSIGN_OR_RETURN(Statement update, connection_.Prepare(schema::kUpdateSession));
  RETURN_IF_ERROR(update.RunWith(id, session.num_places, session.num_empty, session.num_unreadable,
                                 SessionChecksum(id, session)));

  head_.content_id = content_->ContentId();
  ASSIGN_OR_RETURN(Statement update_meta, connection_.Prepare(schema::kUpdateMeta));
  return update_meta.RunWith(std::string_view(schema::kContentIdKey), head_.content_id,
                             MetaChecksum(schema::kContentIdKey, head_.content_id));
}

// The lock of a writer is held already: only readers can be in the way.
absl::Status MapWriter::CommitToFile() {
  connection_.SetBusyTimeout(readers_timeout_ms_);
  const absl::Status status = connection_.Execute(schema::kCommit);
  if (!absl::IsUnavailable(status)) return status;
  return absl::UnavailableError(absl::StrCat(
      "map '", path(), "' cannot be written: a program has been reading it for more than ",
      readers_timeout_ms_ / 1000, " s (fuser tells which); what was committed before is kept: end ",
      "that program, then build with --resume"));
}

absl::Status MapWriter::Commit() {
  if (!has_changes_) return absl::OkStatus();
  RETURN_IF_ERROR(WriteCountsAndContentId());
  RETURN_IF_ERROR(CommitToFile());
  has_changes_ = false;
  return TakeLock();
}

absl::Status MapWriter::SetMeta(const char* key, const std::string& value) {
  RETURN_IF_ERROR(InsertPairs(schema::kSetMeta, {{key, value}}, MetaChecksum));
  has_changes_ = true;
  return Commit();
}

absl::Status MapWriter::ReplaceCalibration(const StoredCalibration& calibration) {
  RETURN_IF_ERROR(WriteCalibration(calibration, head_.content_id, connection_));
  RETURN_IF_ERROR(CommitToFile());
  return TakeLock();
}

absl::Status MapWriter::Release() { return connection_.Execute(schema::kRollback); }

}  // namespace scanloc::mapdb
