#include "map_rows.hpp"

#include <limits>
#include <utility>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {

PlaceCursor::PlaceCursor(Statement statement, const MapHead& head, std::string path)
    : statement_(std::move(statement)),
      head_(&head),
      path_(std::move(path)),
      session_end_(head.sessions.front().num_places) {}

absl::StatusOr<PlaceCursor> PlaceCursor::Open(Connection& connection, const MapHead& head) {
  ASSIGN_OR_RETURN(Statement statement, connection.Prepare(schema::kSelectPlaces));
  return PlaceCursor(std::move(statement), head, connection.path());
}

absl::StatusOr<bool> PlaceCursor::Step() {
  absl::StatusOr<bool> row = statement_.Step();
  if (!row.ok() || !*row) return row;
  while (statement_.num_rows() > session_end_) {
    if (session_ + 1 == head_->sessions.size()) {
      return DamagedError(path_, absl::StrCat("it has more than the ", session_end_,
                                              " places that its sessions count"));
    }
    session_end_ += head_->sessions[++session_].num_places;
  }
  return true;
}

absl::Status PlaceCursor::Read(PlaceRow& row) const {
  const std::int64_t id = statement_.num_rows() - 1;
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path_, absl::StrCat("place ", id, ": ", what));
  };
  row.id = statement_.Int(0);
  row.session = statement_.Int(1);
  row.stamp_ns = statement_.Int(2);
  const std::span<const std::byte> pose = statement_.Blob(3);
  row.pose.assign(pose.begin(), pose.end());
  row.scan = statement_.Text(4);
  row.num_voxels = statement_.Int(5);
  row.checksum = statement_.Int(6);
  if (row.id != id) return damaged(absl::StrCat("its row has id ", row.id));
  if (row.session != static_cast<std::int64_t>(session_)) {
    return damaged(absl::StrCat("it is of session ", row.session, " instead of ", session_));
  }
  if (row.pose.size() != kPoseBytes) return damaged("its pose has not 12 numbers");
  if (absl::Status status = CheckPose(DecodePose(row.pose)); !status.ok()) {
    return damaged(status.message());
  }
  if (absl::Status status = CheckName("its scan", row.scan); !status.ok()) {
    return damaged(status.message());
  }
  if (row.num_voxels < 0 || row.num_voxels > std::numeric_limits<std::uint32_t>::max()) {
    return damaged("its number of voxels is out of range");
  }
  return absl::OkStatus();
}

absl::Status PlaceCursor::CheckEnd() const {
  if (statement_.num_rows() == head_->num_places()) return absl::OkStatus();
  return DamagedError(path_, absl::StrCat("it has ", statement_.num_rows(),
                                          " places; its sessions count ", head_->num_places()));
}

ContextCursor::ContextCursor(Statement statement, const Params& params, std::string path)
    : statement_(std::move(statement)), shapes_(ContextShapes(params)), path_(std::move(path)) {}

absl::StatusOr<ContextCursor> ContextCursor::Open(Connection& connection, const Params& params) {
  ASSIGN_OR_RETURN(Statement statement, connection.Prepare(schema::kSelectContexts));
  return ContextCursor(std::move(statement), params, connection.path());
}

const ContextShape& ContextCursor::shape() const {
  return shapes_[static_cast<std::size_t>(statement_.num_rows() - 1) % shapes_.size()];
}

std::int64_t ContextCursor::place() const {
  return (statement_.num_rows() - 1) / static_cast<std::int64_t>(shapes_.size());
}

absl::Status ContextCursor::Read(ContextValues& values) {
  return ReadContextRow(statement_, shape(), place(), statement_.num_rows() - 1, path_, hasher_,
                        values);
}

std::string NameOf(const ContextShape& shape, std::int64_t place) {
  return absl::StrCat("place ", place, ", ",
                      shape.kind == DescriptorKind::kPolar ? "polar" : "cart", " context ",
                      shape.variant);
}

absl::Status ReadContextRow(const Statement& statement, const ContextShape& shape,
                            std::int64_t place, std::int64_t id, const std::string& path,
                            Hasher& scratch, ContextValues& values) {
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path, absl::StrCat(NameOf(shape, place), ": ", what));
  };
  const ContextRow row{statement.Int(0),  statement.Int(1),  statement.Int(2),  statement.Int(3),
                       statement.Blob(5), statement.Blob(6), statement.Blob(7), statement.Int(4)};
  values.checksum = row.checksum;
  if (ContextChecksum(row, scratch) != row.checksum) return damaged("its checksum does not match");
  if (row.id != id || row.place != place || row.kind != static_cast<std::int64_t>(shape.kind) ||
      row.variant != shape.variant) {
    return damaged(absl::StrCat("its row is that of place ", row.place, ", kind ", row.kind,
                                ", variant ", row.variant));
  }
  values.cells_cm.resize(shape.num_cells());
  values.retrieval_cm.resize(static_cast<std::size_t>(shape.num_rows));
  values.aligning_cm.resize(static_cast<std::size_t>(shape.num_cols));
  if (!DecodeCells(row.cells, values.cells_cm)) return damaged("its cells are malformed");
  if (!DecodeKey(row.retrieval_key, shape.num_cols * Context::kMaxHeight_cm, values.retrieval_cm) ||
      !DecodeKey(row.aligning_key, shape.num_rows * Context::kMaxHeight_cm, values.aligning_cm)) {
    return damaged("its keys are malformed");
  }
  return absl::OkStatus();
}

StructureCursor::StructureCursor(Statement statement, int schema_version, double reach_m,
                                 std::string path)
    : statement_(std::move(statement)),
      schema_version_(schema_version),
      reach_m_(reach_m),
      path_(std::move(path)) {}

absl::StatusOr<StructureCursor> StructureCursor::Open(Connection& connection, const MapHead& head) {
  ASSIGN_OR_RETURN(Statement statement,
                   connection.Prepare(head.schema_version < 3 ? schema::kSelectStructures2
                                                              : schema::kSelectStructures));
  return StructureCursor(std::move(statement), head.schema_version,
                         head.params.automatic.posts.reach_m, connection.path());
}

absl::Status StructureCursor::Read(Structure& structure, std::int64_t& checksum) {
  return ReadStructureRow(statement_, statement_.num_rows() - 1, schema_version_, reach_m_, path_,
                          hasher_, structure, checksum);
}

absl::Status ReadStructureRow(const Statement& statement, std::int64_t place, int schema_version,
                              double reach_m, const std::string& path, Hasher& scratch,
                              Structure& structure, std::int64_t& checksum) {
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path, absl::StrCat("place ", place, ", structure: ", what));
  };
  const StructureRow row{statement.Int(0),  statement.Real(1), statement.Real(2),
                         statement.Real(3), statement.Blob(5), statement.Int(4)};
  checksum = row.checksum;
  if (StructureChecksum(row, scratch) != row.checksum) {
    return damaged("its checksum does not match");
  }
  if (row.place != place) return damaged(absl::StrCat("its row is that of place ", row.place));
  structure.roll_rad = static_cast<float>(row.roll_rad);
  structure.pitch_rad = static_cast<float>(row.pitch_rad);
  structure.height_m = static_cast<float>(row.height_m);
  if (!DecodePosts(row.posts, schema_version, structure.posts))
    return damaged("its posts are malformed");
  if (absl::Status status = Validate(structure, reach_m); !status.ok()) {
    return damaged(status.message());
  }
  return absl::OkStatus();
}

DescriptorReader::DescriptorReader(ContextCursor contexts,
                                   std::optional<StructureCursor> structures, std::string path)
    : contexts_(std::move(contexts)), structures_(std::move(structures)), path_(std::move(path)) {}

absl::StatusOr<DescriptorReader> DescriptorReader::Open(Connection& connection,
                                                        const MapHead& head) {
  ASSIGN_OR_RETURN(ContextCursor contexts, ContextCursor::Open(connection, head.params));
  std::optional<StructureCursor> structures;
  if (head.params.structure.enabled) {
    ASSIGN_OR_RETURN(structures, StructureCursor::Open(connection, head));
  }
  return DescriptorReader(std::move(contexts), std::move(structures), connection.path());
}

absl::Status DescriptorReader::CheckEnd() {
  absl::StatusOr<bool> row = contexts_.Step();
  if (row.ok() && !*row && structures_.has_value()) row = structures_->Step();
  if (!row.ok() || !*row) return row.status();
  return DamagedError(path_, "it has more contexts or structures than its places need");
}

}  // namespace scanloc::mapdb
