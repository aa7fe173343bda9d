#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "key_rows.hpp"
#include "map_head.hpp"
#include "map_rows.hpp"
#include "payload_cache.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map/payload.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// What the keys of a map say of the rows that stay in its file.
struct ExpectedRows {
  /// The lower half of the checksum of each context and structure, place by place: a row that was
  /// there when the map was opened, and not one of the same place in another map.
  std::vector<std::uint32_t> checksums;
};

/// Contexts and structures of a map file, each read when it is asked for.
///
/// A few connections, each lent to one thread at a time. Each batch of reads is one transaction, so
/// that a build may append to the file meanwhile; what was there stays the same.
class FilePayload : public PayloadReader {
 public:
  /// Of a map that was just read from the path with that head. Unavailable: it was written since.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const FilePayload>> Open(
      const std::string& path, const MapHead& head, ExpectedRows expected,
      const OpenOptions& options);

  ~FilePayload() override { cache_->Forget(number_); }

  [[nodiscard]] absl::Status Read(
      std::span<const PayloadId> ids, const SearchControl& control,
      std::vector<std::shared_ptr<const Payload>>& payloads) const override;

  [[nodiscard]] absl::Status Scrub(
      const std::function<bool(std::size_t num_done)>& go_on) const override;

 private:
  /// One connection, with all that reading a row needs.
  struct Reader {
    Connection connection;
    Statement context;
    Statement structure;
    Statement keys;
    std::optional<Statement> bearings;  // where the file has them
    KeysRowReader keys_reader;
    Hasher hasher;
    ContextValues values;
  };
  class Lease;

  FilePayload(const MapHead& head, ExpectedRows expected, std::shared_ptr<PayloadCache> cache);
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Reader>> OpenReader(const std::string& path,
                                                                          const MapHead& head);

  /// Index of a part among those of its place.
  [[nodiscard]] std::size_t PartOf(const PayloadId& id) const;
  [[nodiscard]] std::size_t num_parts() const { return shapes_.size() + (has_structures_ ? 1 : 0); }
  [[nodiscard]] absl::StatusOr<std::shared_ptr<const Payload>> ReadRow(const PayloadId& id,
                                                                       Reader& reader) const;
  [[nodiscard]] absl::Status ReadRows(std::span<const PayloadId> ids,
                                      std::span<const std::size_t> missing,
                                      const SearchControl& control,
                                      std::vector<std::shared_ptr<const Payload>>& payloads) const;
  /// Compares the bearings of a place with what its structure says.
  [[nodiscard]] absl::Status ScrubBearings(std::int64_t place, const Structure& structure,
                                           Reader& reader) const;
  /// Compares the keys of a place with its contexts and structure.
  [[nodiscard]] absl::Status ScrubPlace(std::int64_t place, Reader& reader) const;
  [[nodiscard]] absl::Status ScrubPlaces(std::size_t begin, std::size_t end, Reader& reader) const;
  [[nodiscard]] absl::Status BeginReading(const SearchControl& control, Reader& reader) const;
  static void EndReading(absl::Status& status, Reader& reader);

  const std::vector<ContextShape> shapes_;
  const bool has_structures_;
  const int schema_version_;
  const Params params_;
  const ExpectedRows expected_;
  std::string path_;
  const std::shared_ptr<PayloadCache> cache_;
  const std::uint64_t number_;  // of the map in the cache
  mutable std::mutex mutex_;
  mutable std::condition_variable is_back_;
  mutable std::vector<std::unique_ptr<Reader>> idle_;
  mutable std::mutex scrub_mutex_;
  mutable std::unique_ptr<Reader> scrubber_;
};

}  // namespace scanloc::mapdb
