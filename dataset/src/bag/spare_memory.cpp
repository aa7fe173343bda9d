#include "bag/spare_memory.hpp"

#include <algorithm>
#include <utility>

namespace scanloc::dataset {
namespace {

constexpr std::size_t kMostBytesOfBlock = 16 << 20;
// The chunks of a file are about as large, not quite.
constexpr std::size_t kRoundedTo = 1 << 20;

}  // namespace

ByteArray SpareMemory::Take(std::size_t num_bytes) {
  Block block{nullptr, (num_bytes / kRoundedTo + 1) * kRoundedTo};
  {
    const std::lock_guard lock(mutex_);
    const auto smallest = std::ranges::min_element(spare_, [&](const Block& a, const Block& b) {
      return std::pair(a.num_bytes < num_bytes, a.num_bytes) <
             std::pair(b.num_bytes < num_bytes, b.num_bytes);
    });
    if (smallest != spare_.end() && smallest->num_bytes >= num_bytes) {
      block = std::move(*smallest);
      spare_.erase(smallest);
    }
  }
  // new[] without a value leaves the bytes, and with them the pages, untouched.
  if (block.data == nullptr) block.data.reset(new char[block.num_bytes]);
  auto give = [self = shared_from_this(), size = block.num_bytes](char* data) {
    self->Give({std::unique_ptr<char[]>(data), size});
  };
  ByteArray taken(nullptr, std::move(give));
  taken.reset(block.data.release());
  return taken;
}

void SpareMemory::Give(Block block) noexcept {
  if (block.num_bytes > kMostBytesOfBlock) return;
  const std::lock_guard lock(mutex_);
  if (spare_.size() < kMostBlocks) {
    spare_.push_back(std::move(block));  // allocates nothing
    return;
  }
  // The larger serve for more.
  const auto smallest = std::ranges::min_element(spare_, {}, &Block::num_bytes);
  if (smallest->num_bytes < block.num_bytes) std::swap(*smallest, block);
}

}  // namespace scanloc::dataset
