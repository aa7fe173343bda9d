#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"
#include "file_bytes.hpp"

namespace scanloc::dataset {

/// The chunks of a file that were read last, are being read, or are read ahead. Any number of
/// threads may use it at once.
class ChunkCache {
 public:
  using Records = std::shared_ptr<const FileBytes>;
  /// Called by several threads at once, for different chunks.
  using Reader = std::function<absl::StatusOr<FileBytes>(std::uint32_t number)>;

  explicit ChunkCache(Reader read) : read_(std::move(read)) {}
  /// Waits for what is read ahead.
  ~ChunkCache() = default;

  /// Reads the chunk, or waits for who reads it already. An error is not kept,
  /// but for DataLoss.
  [[nodiscard]] absl::StatusOr<Records> Get(std::uint32_t number, std::uint64_t num_bytes);

  /// Whether it was got, and is still here.
  [[nodiscard]] bool WasGot(std::uint32_t number) const;

  /// Begins to read a chunk on a thread of its own, which will be got soon. Without a thread, or
  /// where it is large, nothing happens.
  void ReadAhead(std::uint32_t number, std::uint64_t num_bytes);

 private:
  struct Entry {
    std::uint32_t number;
    std::uint64_t num_bytes;
    std::shared_future<absl::StatusOr<Records>> records;
    bool was_got;
  };
  using Entries = std::deque<Entry>;

  [[nodiscard]] absl::StatusOr<Records> Read(std::uint32_t number) const;
  /// Of a mutex that is locked. The end where it is not here.
  [[nodiscard]] Entries::iterator Find(std::uint32_t number);
  /// Takes out what is too much. To be destroyed without the mutex: it may wait.
  [[nodiscard]] Entries TakeOutOldest();

  const Reader read_;
  mutable std::mutex mutex_;
  Entries entries_;  // the newest first; last: its threads end before what they read goes
};

}  // namespace scanloc::dataset
