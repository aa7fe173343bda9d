#include "key_rows.hpp"

#include <optional>

#include "absl/strings/str_cat.h"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {

void KeysRowMaker::Start(std::int64_t place) {
  row_ = {};
  row_.place = place;
  retrieval_keys_.clear();
  checksums_.clear();
}

void KeysRowMaker::AddContext(std::span<const std::byte> retrieval_key, std::int64_t checksum) {
  retrieval_keys_.insert(retrieval_keys_.end(), retrieval_key.begin(), retrieval_key.end());
  AppendInt64(checksum, checksums_);
}

void KeysRowMaker::AddStructure(const StructureRow& structure, std::size_t num_posts) {
  row_.roll_rad = structure.roll_rad;
  row_.pitch_rad = structure.pitch_rad;
  row_.height_m = structure.height_m;
  row_.num_posts = static_cast<std::int64_t>(num_posts);
  AppendInt64(structure.checksum, checksums_);
}

const KeysRow& KeysRowMaker::Finish() {
  row_.retrieval_keys = retrieval_keys_;
  row_.checksums = checksums_;
  row_.checksum = KeysChecksum(row_, hasher_);
  return row_;
}

KeysRowReader::KeysRowReader(const Params& params, std::string path)
    : shapes_(ContextShapes(params)),
      has_structures_(params.structure.enabled),
      path_(std::move(path)) {
  for (const ContextShape& shape : shapes_) {
    key_bytes_ += sizeof(std::int32_t) * static_cast<std::size_t>(shape.num_rows);
  }
}

absl::StatusOr<KeysCursor> KeysCursor::Open(Connection& connection, const MapHead& head) {
  ASSIGN_OR_RETURN(Statement statement, connection.Prepare(schema::kSelectKeys));
  return KeysCursor(std::move(statement), {head.params, connection.path()});
}

absl::Status KeysRowReader::Read(const Statement& statement, std::int64_t place, PlaceKeys& keys) {
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path_, absl::StrCat("keys of place ", place, ": ", what));
  };
  const KeysRow row{statement.Int(0), statement.Real(1), statement.Real(2), statement.Real(3),
                    statement.Int(4), statement.Blob(6), statement.Blob(7), statement.Int(5)};
  if (KeysChecksum(row, hasher_) != row.checksum) return damaged("their checksum does not match");
  if (row.place != place) return damaged(absl::StrCat("their row is that of place ", row.place));
  const std::size_t num_checksums = shapes_.size() + (has_structures_ ? 1 : 0);
  if (row.retrieval_keys.size() != key_bytes_ ||
      row.checksums.size() != num_checksums * sizeof(std::int64_t)) {
    return damaged("they are of other contexts than the map has");
  }
  keys.retrieval_cm.resize(shapes_.size());
  std::span<const std::byte> rest = row.retrieval_keys;
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    std::vector<std::int32_t>& key_cm = keys.retrieval_cm[i];
    key_cm.resize(static_cast<std::size_t>(shapes_[i].num_rows));
    const std::size_t size = sizeof(std::int32_t) * key_cm.size();
    if (!DecodeKey(rest.first(size), shapes_[i].num_cols * Context::kMaxHeight_cm, key_cm)) {
      return damaged("a sum is out of range");
    }
    rest = rest.subspan(size);
  }
  keys.checksums.resize(num_checksums);
  for (std::size_t i = 0; i < num_checksums; ++i) keys.checksums[i] = Int64At(row.checksums, i);
  const Structure ground{.roll_rad = static_cast<float>(row.roll_rad),
                         .pitch_rad = static_cast<float>(row.pitch_rad),
                         .height_m = static_cast<float>(row.height_m),
                         .posts = {}};
  if (absl::Status status = Validate(ground); !status.ok()) return damaged(status.message());
  keys.ground = {ground.ground(), row.num_posts > 0};
  return absl::OkStatus();
}

absl::StatusOr<BearingGrid> ReadBearingsRow(const Statement& statement, std::int64_t place,
                                            const std::string& path, Hasher& scratch) {
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path, absl::StrCat("bearings of place ", place, ": ", what));
  };
  const BearingsRow row{statement.Int(0), statement.Blob(2), statement.Int(1)};
  if (BearingsChecksum(row, scratch) != row.checksum) {
    return damaged("their checksum does not match");
  }
  if (row.place != place) return damaged(absl::StrCat("their row is that of place ", row.place));
  const std::optional<BearingGrid> bearings = DecodeBearings(row.rings);
  if (!bearings) return damaged(absl::StrCat("they have ", row.rings.size(), " bytes"));
  return *bearings;
}

absl::StatusOr<BearingsCursor> BearingsCursor::Open(Connection& connection, const MapHead& head) {
  if (head.schema_version < schema::kBearingsVersion) {
    ASSIGN_OR_RETURN(StructureCursor structures, StructureCursor::Open(connection, head));
    return BearingsCursor(std::move(structures), head, connection.path());
  }
  ASSIGN_OR_RETURN(Statement statement, connection.Prepare(schema::kSelectBearings));
  return BearingsCursor(std::move(statement), head, connection.path());
}

absl::StatusOr<bool> BearingsCursor::Step() {
  return std::visit([](auto& rows) { return rows.Step(); }, rows_);
}

absl::StatusOr<BearingGrid> BearingsCursor::Read() {
  if (const auto* statement = std::get_if<Statement>(&rows_)) {
    return ReadBearingsRow(*statement, statement->num_rows() - 1, path_, hasher_);
  }
  std::int64_t checksum = 0;
  RETURN_IF_ERROR(std::get<StructureCursor>(rows_).Read(structure_, checksum));
  return BearingsOf(structure_.posts, head_->params);
}

}  // namespace scanloc::mapdb
