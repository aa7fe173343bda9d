#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "scanloc/core/map/payload.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {

/// What was not used since a quarter of all came in goes first.
class PayloadCache {
 public:
  /// A row of a map that is open.
  struct Row {
    std::uint64_t map = 0;  ///< NewMap
    std::uint64_t number = 0;

    friend bool operator==(const Row&, const Row&) = default;
    template <typename H>
    friend H AbslHashValue(H hash, const Row& row) {
      return H::combine(std::move(hash), row.map, row.number);
    }
  };

  explicit PayloadCache(std::int64_t max_bytes) : max_bytes_(max_bytes) {}

  /// A number that no map had before.
  [[nodiscard]] std::uint64_t NewMap();

  /// Of each row; null where it is not there.
  [[nodiscard]] std::vector<std::shared_ptr<const Payload>> Find(std::span<const Row> rows);
  void Add(const Row& row, std::shared_ptr<const Payload> payload);
  [[nodiscard]] std::int64_t held_bytes() const;
  /// All rows of a map that is no longer open.
  void Forget(std::uint64_t map);

 private:
  struct Entry {
    Row row;
    std::shared_ptr<const Payload> payload;
    std::int64_t bytes;
    std::uint64_t moved;  // how many had been added when it was put first
  };

  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // those used last first
  absl::flat_hash_map<Row, std::list<Entry>::iterator> at_;
  std::uint64_t num_maps_ = 0;
  std::uint64_t num_added_ = 0;
  std::int64_t bytes_ = 0;
};

}  // namespace scanloc::mapdb
