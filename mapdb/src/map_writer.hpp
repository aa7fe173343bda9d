#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "calibration_rows.hpp"
#include "checksum.hpp"
#include "encoding.hpp"
#include "key_rows.hpp"
#include "map_rows.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_builder.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// Writes rows into a map file. It is in a write transaction all the time, which keeps other
/// writers out; what was not committed is lost when it closes. After an error it must not be used
/// further.
class MapWriter {
 public:
  /// Opens an existing file and takes the lock: Unavailable if another writer has it. An empty
  /// file, as a build killed before its first commit leaves, is_new(); else the small tables are
  /// read and the content id is checked, without the contexts.
  [[nodiscard]] static absl::StatusOr<MapWriter> Open(const std::string& path);

  [[nodiscard]] bool is_new() const { return head_.param_texts.empty(); }
  /// Writes the tables of a map without sessions. Requires is_new().
  [[nodiscard]] absl::Status Initialize(const Params& params);

  [[nodiscard]] const MapHead& head() const { return head_; }
  [[nodiscard]] const std::string& path() const { return connection_.path(); }
  [[nodiscard]] std::int64_t num_places() const { return num_places_; }
  /// The places of the last session.
  [[nodiscard]] absl::StatusOr<std::vector<PlaceRow>> ReadLastSession();

  /// Adds a session and commits, so that the file has it from the start on.
  [[nodiscard]] absl::Status StartSession(const SessionPlan& plan);
  /// Adds a place to the last session. Requires Validate(descriptor, head().params).ok().
  [[nodiscard]] absl::Status AddPlace(const PlannedScan& scan, const PlaceDescriptor& descriptor);
  /// Counts a scan of the last session that is no place.
  void AddSkipped(SkipReason reason);
  [[nodiscard]] absl::Status Commit();
  /// Replaces the calibration and commits. Requires a schema version of 2 at least and that
  /// everything is committed.
  [[nodiscard]] absl::Status ReplaceCalibration(const StoredCalibration& calibration);
  /// Sets what the map says of itself beside its content (a key of meta), and commits. Requires
  /// that everything is committed.
  [[nodiscard]] absl::Status SetMeta(const char* key, const std::string& value);
  /// How long a commit waits for those who read the file.
  void SetReadersTimeout(int milliseconds) { readers_timeout_ms_ = milliseconds; }
  /// Lets other writers in. Requires that everything is committed; the last call.
  [[nodiscard]] absl::Status Release();

 private:
  struct EncodedContext {
    Bytes retrieval_key;
    Bytes aligning_key;
    Bytes cells;
    ContextRow row;  // its blobs are the ones above
  };

  explicit MapWriter(Connection connection) : connection_(std::move(connection)) {}

  absl::Status TakeLock();
  absl::Status CommitToFile();
  absl::Status ReadExisting();
  absl::Status PrepareInserts();
  absl::Status InsertPairs(const char* sql, const ParamTexts& pairs,
                           std::int64_t (*checksum)(std::string_view, std::string_view));
  void EncodeDescriptor(const PlaceDescriptor& descriptor, PlaceRow& place);
  void EncodeStructure(const Structure& structure, std::int64_t place);
  absl::Status InsertPlace(const PlaceRow& place);
  absl::Status InsertContext(const ContextRow& context);
  absl::Status InsertStructure();
  absl::Status InsertKeys(const KeysRow& row);
  absl::Status InsertBearings();
  absl::Status WriteCountsAndContentId();

  Connection connection_;
  MapHead head_;
  std::vector<ContextShape> shapes_;
  std::vector<EncodedContext> contexts_;  // of the place being added, one per shape
  Bytes posts_;                           // of the place being added
  StructureRow structure_;
  Bytes rings_;  // of the place being added
  std::optional<ContentHasher> content_;
  std::optional<Statement> insert_place_;
  std::optional<Statement> insert_context_;
  std::optional<Statement> insert_structure_;  // where the map has structures
  std::optional<Statement> insert_keys_;       // where the schema has the table
  std::optional<Statement> insert_bearings_;   // likewise, and the map structures
  KeysRowMaker keys_;                          // of the place being added
  std::int64_t num_places_ = 0;
  std::optional<std::int64_t> data_version_;  // of the last own commit
  bool has_changes_ = false;
  int readers_timeout_ms_ = 60'000;
  Hasher place_hasher_;
  Hasher context_hasher_;
};

}  // namespace scanloc::mapdb
