#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "checksum.hpp"
#include "map_head.hpp"
#include "map_rows.hpp"
#include "scanloc/core/map/map.hpp"
#include "sqlite.hpp"

/// The tables `keys` and `bearings` of a map file: what is needed to find candidates, so that a map
/// can be opened without its contexts and structures being read.
namespace scanloc::mapdb {

/// One row, decoded.
struct PlaceKeys {
  std::vector<std::vector<std::int32_t>>
      retrieval_cm;  ///< one a context, as ContextShapes has them
  PlaceGround ground;
  std::vector<std::int64_t> checksums;  ///< of the contexts' rows in order, and the structure's
};

/// Makes the row of a place, context by context.
class KeysRowMaker {
 public:
  void Start(std::int64_t place);
  void AddContext(std::span<const std::byte> retrieval_key, std::int64_t checksum);
  void AddStructure(const StructureRow& structure, std::size_t num_posts);
  /// Valid until the next Start.
  [[nodiscard]] const KeysRow& Finish();

 private:
  KeysRow row_;
  Bytes retrieval_keys_;
  Bytes checksums_;
  Hasher hasher_;
};

/// Decodes rows of `keys`, of kSelectKeys or kSelectKeysOfPlace.
class KeysRowReader {
 public:
  KeysRowReader(const Params& params, std::string path);

  /// The row that the statement is at, which must be that of a place; checks its checksum and its
  /// values.
  [[nodiscard]] absl::Status Read(const Statement& statement, std::int64_t place, PlaceKeys& keys);

 private:
  std::vector<ContextShape> shapes_;
  std::size_t key_bytes_ = 0;  // of a row
  bool has_structures_;
  std::string path_;
  Hasher hasher_;
};

/// The rows of `keys` in order. Requires a schema version of kKeysVersion at least.
class KeysCursor {
 public:
  [[nodiscard]] static absl::StatusOr<KeysCursor> Open(Connection& connection, const MapHead& head);

  /// False after the last row, as PlaceCursor.
  [[nodiscard]] absl::StatusOr<bool> Step() { return statement_.Step(); }
  /// KeysRowReader::Read of the current row.
  [[nodiscard]] absl::Status Read(PlaceKeys& keys) {
    return reader_.Read(statement_, statement_.num_rows() - 1, keys);
  }

 private:
  KeysCursor(Statement statement, KeysRowReader reader)
      : statement_(std::move(statement)), reader_(std::move(reader)) {}

  Statement statement_;
  KeysRowReader reader_;
};

/// Decodes the row of kSelectBearings or kSelectBearingsOfPlace that a statement is at, which must
/// be that of a place; checks its checksum.
[[nodiscard]] absl::StatusOr<BearingGrid> ReadBearingsRow(const Statement& statement,
                                                          std::int64_t place,
                                                          const std::string& path, Hasher& scratch);

/// The bearings of a map with structures in order: the rows of `bearings`, or of a file of an older
/// schema what its structures say, which takes long where they are many.
class BearingsCursor {
 public:
  [[nodiscard]] static absl::StatusOr<BearingsCursor> Open(Connection& connection,
                                                           const MapHead& head);

  /// False after the last row, as PlaceCursor.
  [[nodiscard]] absl::StatusOr<bool> Step();
  [[nodiscard]] absl::StatusOr<BearingGrid> Read();

 private:
  BearingsCursor(std::variant<Statement, StructureCursor> rows, const MapHead& head,
                 std::string path)
      : rows_(std::move(rows)), head_(&head), path_(std::move(path)) {}

  std::variant<Statement, StructureCursor> rows_;
  const MapHead* head_;
  std::string path_;
  Structure structure_;
  Hasher hasher_;
};

}  // namespace scanloc::mapdb
