#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "file_bytes.hpp"

namespace scanloc::dataset {

/// Memory of bytes that are not needed any more, for those that come next: fresh pages cost as much
/// as to fill them. Any number of threads may use it at once.
class SpareMemory : public std::enable_shared_from_this<SpareMemory> {
 public:
  SpareMemory() { spare_.reserve(kMostBlocks); }

  /// At least num_bytes, of whatever content, which come back when they are let go of; they may
  /// outlive this. Throws std::bad_alloc.
  [[nodiscard]] ByteArray Take(std::size_t num_bytes);

 private:
  struct Block {
    std::unique_ptr<char[]> data;
    std::size_t num_bytes;
  };

  /// The compressed bytes and the chunk, of two threads.
  static constexpr std::size_t kMostBlocks = 4;

  void Give(Block block) noexcept;

  std::mutex mutex_;
  std::vector<Block> spare_;
};

}  // namespace scanloc::dataset
