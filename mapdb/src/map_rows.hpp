#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "checksum.hpp"
#include "encoding.hpp"
#include "map_head.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/status_macros.hpp"
#include "sqlite.hpp"

/// Reading a map file row by row, each row checked: what load, info, verify, append and merge
/// share.
namespace scanloc::mapdb {

/// The places of a map in order. `head` must outlive it.
class PlaceCursor {
 public:
  [[nodiscard]] static absl::StatusOr<PlaceCursor> Open(Connection& connection,
                                                        const MapHead& head);

  /// False after the last row. An error is SQLite's; the cursor is then at its end.
  [[nodiscard]] absl::StatusOr<bool> Step();
  /// Reads the current row. DataLoss if it is not what can stand there; another Step may follow.
  /// Its checksum is not compared: it covers the contexts.
  [[nodiscard]] absl::Status Read(PlaceRow& row) const;
  /// DataLoss unless the file has as many places as its sessions say. After the last Step.
  [[nodiscard]] absl::Status CheckEnd() const;

 private:
  PlaceCursor(Statement statement, const MapHead& head, std::string path);

  Statement statement_;
  const MapHead* head_;
  std::string path_;
  std::size_t session_ = 0;       // of the current row
  std::int64_t session_end_ = 0;  // id behind the last place of that session
};

/// Gives visit(row) every place in order, each checked, until it returns an error, and compares the
/// content id at the end. Gives the hash, ready for further places of the last session.
template <typename Visitor>
absl::StatusOr<ContentHasher> VisitPlaces(Connection& connection, const MapHead& head,
                                          Visitor&& visit) {
  ASSIGN_OR_RETURN(PlaceCursor places, PlaceCursor::Open(connection, head));
  ContentHasher content(head.param_texts);
  PlaceRow row;
  while (true) {
    ASSIGN_OR_RETURN(const bool has_row, places.Step());
    if (!has_row) break;
    RETURN_IF_ERROR(places.Read(row));
    content.AddSessionsBefore(static_cast<std::size_t>(row.session) + 1, head.sessions);
    content.AddPlace(row);
    RETURN_IF_ERROR(visit(row));
  }
  RETURN_IF_ERROR(places.CheckEnd());
  content.AddSessionsBefore(head.sessions.size(), head.sessions);
  if (content.ContentId() != head.content_id) {
    return DamagedError(connection.path(), "its content id does not match its content");
  }
  return content;
}

/// Name and version of a place's part in the text of an error.
[[nodiscard]] std::string NameOf(const ContextShape& shape, std::int64_t place);

/// One context, decoded.
struct ContextValues {
  std::vector<std::uint16_t> cells_cm;
  std::vector<std::int32_t> retrieval_cm;
  std::vector<std::int32_t> aligning_cm;
  std::int64_t checksum = 0;
};

/// Decodes the row of kSelectContexts or kSelectContext that a statement is at, which must be that
/// of a place and shape; checks its checksum, shape and heights, but not keys against cells.
[[nodiscard]] absl::Status ReadContextRow(const Statement& statement, const ContextShape& shape,
                                          std::int64_t place, std::int64_t id,
                                          const std::string& path, Hasher& scratch,
                                          ContextValues& values);
/// Likewise that of kSelectStructures or kSelectStructure; checks its checksum and its values.
[[nodiscard]] absl::Status ReadStructureRow(const Statement& statement, std::int64_t place,
                                            int schema_version, double reach_m,
                                            const std::string& path, Hasher& scratch,
                                            Structure& structure, std::int64_t& checksum);

/// The contexts of a map in order, those of a place as ContextShapes has them.
class ContextCursor {
 public:
  [[nodiscard]] static absl::StatusOr<ContextCursor> Open(Connection& connection,
                                                          const Params& params);

  /// False after the last row, as PlaceCursor.
  [[nodiscard]] absl::StatusOr<bool> Step() { return statement_.Step(); }
  /// ReadContextRow of the current row.
  [[nodiscard]] absl::Status Read(ContextValues& values);
  /// What the current row is.
  [[nodiscard]] const ContextShape& shape() const;
  [[nodiscard]] std::int64_t place() const;
  [[nodiscard]] const std::vector<ContextShape>& shapes() const { return shapes_; }

 private:
  ContextCursor(Statement statement, const Params& params, std::string path);

  Statement statement_;
  std::vector<ContextShape> shapes_;
  std::string path_;
  Hasher hasher_;
};

/// The structures of a map in order, one a place.
class StructureCursor {
 public:
  [[nodiscard]] static absl::StatusOr<StructureCursor> Open(Connection& connection,
                                                            const MapHead& head);

  /// False after the last row, as PlaceCursor.
  [[nodiscard]] absl::StatusOr<bool> Step() { return statement_.Step(); }
  /// ReadStructureRow of the current row.
  [[nodiscard]] absl::Status Read(Structure& structure, std::int64_t& checksum);

 private:
  StructureCursor(Statement statement, int schema_version, double reach_m, std::string path);

  Statement statement_;
  int schema_version_;
  double reach_m_;
  std::string path_;
  Hasher hasher_;
};

/// All that a map holds of its places beside their poses, place by place.
class DescriptorReader {
 public:
  [[nodiscard]] static absl::StatusOr<DescriptorReader> Open(Connection& connection,
                                                             const MapHead& head);

  /// Gives visit(shape, values) each context of the next place, in order, and fills structure();
  /// then compares the place's checksum. DataLoss if the place has not all that it should have.
  template <typename Visitor>
  absl::Status Read(const PlaceRow& place, Visitor&& visit) {
    StartPlaceChecksum(place, hasher_);
    for (std::size_t i = 0; i < contexts_.shapes().size(); ++i) {
      RETURN_IF_ERROR(Advance(contexts_, "contexts"));
      RETURN_IF_ERROR(contexts_.Read(values_));
      hasher_.Add(values_.checksum);
      visit(contexts_.shape(), values_);
    }
    if (structures_.has_value()) {
      RETURN_IF_ERROR(Advance(*structures_, "structures"));
      std::int64_t checksum = 0;
      RETURN_IF_ERROR(structures_->Read(structure_, checksum));
      hasher_.Add(checksum);
    }
    if (hasher_.Digest64() == place.checksum) return absl::OkStatus();
    return DamagedError(path_, absl::StrCat("place ", place.id, ": its checksum does not match"));
  }

  [[nodiscard]] bool has_structures() const { return structures_.has_value(); }
  /// Of the place read last.
  [[nodiscard]] const Structure& structure() const { return structure_; }

  /// DataLoss unless every row was read.
  [[nodiscard]] absl::Status CheckEnd();

 private:
  DescriptorReader(ContextCursor contexts, std::optional<StructureCursor> structures,
                   std::string path);

  template <typename Cursor>
  absl::Status Advance(Cursor& cursor, const char* what) {
    const absl::StatusOr<bool> row = cursor.Step();
    if (!row.ok() || *row) return row.status();
    return DamagedError(path_, absl::StrCat(what, " are missing at its end"));
  }

  ContextCursor contexts_;
  std::optional<StructureCursor> structures_;
  std::string path_;
  ContextValues values_;
  Structure structure_;
  Hasher hasher_;
};

}  // namespace scanloc::mapdb
