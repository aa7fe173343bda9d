#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace scanloc {

/// How long the blocks of SharedBlocks are: at least kMinBlock elements, then up to the first whose
/// hash is a multiple of kBlockOdds, at most kMaxBlock.
inline constexpr std::size_t kMinBlock = std::size_t{1} << 15;
inline constexpr std::uint64_t kBlockOdds = std::uint64_t{1} << 16;
inline constexpr std::size_t kMaxBlock = std::size_t{1} << 18;

/// What SharedBlocks is told of an element of whole numbers: FNV-1a, a number at a time.
template <typename Values>
std::uint64_t BlockHash(const Values& values) {
  std::uint64_t hash = 14'695'981'039'346'656'037U;
  for (const auto value : values) {
    hash = (hash ^ static_cast<std::uint64_t>(value)) * 1'099'511'628'211U;
  }
  return hash ^ hash >> 32U;
}

/// A sequence that grows at its end, in blocks. A full block never changes, and is held by several
/// sequences at once where they are equal there, as those of a map and of its next version.
///
/// Where a block ends is said by what is in it, not by its number: what is put into the middle of a
/// sequence, or taken out, makes the block there another one, and those behind it stay as they are.
///
/// Block: what elements one behind the other are held in; a value that can be compared.
template <typename Block>
class SharedBlocks {
 public:
  struct Position {
    const Block* block;
    std::size_t index;  // in the block
  };

  [[nodiscard]] std::size_t size() const { return num_in_full() + num_in_last_; }

  /// O(log n) in the blocks.
  [[nodiscard]] Position at(std::size_t i) const {
    const auto next = std::upper_bound(ends_.begin(), ends_.end(), i);
    const auto number = static_cast<std::size_t>(next - ends_.begin());
    const std::size_t begin = number == 0 ? 0 : ends_[number - 1];
    return {number < full_.size() ? full_[number].get() : &last_, i - begin};
  }

  /// The block that is not full: append to it, then tell the hash of what was appended.
  [[nodiscard]] Block& last() { return last_; }
  [[nodiscard]] const Block& last() const { return last_; }
  /// Elements in it.
  [[nodiscard]] std::size_t num_in_last() const { return num_in_last_; }
  void Appended(std::uint64_t hash) {
    ++num_in_last_;
    const bool is_end = num_in_last_ >= kMinBlock && hash % kBlockOdds == 0;
    if (!is_end && num_in_last_ < kMaxBlock) return;
    full_.push_back(std::make_shared<const Block>(last_));  // without what was reserved
    ends_.push_back(size());
    last_ = Block();
    num_in_last_ = 0;
  }

  [[nodiscard]] const std::vector<std::shared_ptr<const Block>>& full() const { return full_; }
  /// One behind the last element of each full block.
  [[nodiscard]] const std::vector<std::size_t>& ends() const { return ends_; }
  [[nodiscard]] std::size_t num_in_full() const { return ends_.empty() ? 0 : ends_.back(); }

  /// Holds the full blocks of another sequence in place of its own that are equal, among those that
  /// became full since the last call.
  void ShareWith(const SharedBlocks& other) {
    for (; num_looked_at_ < full_.size(); ++num_looked_at_) {
      std::shared_ptr<const Block>& own = full_[num_looked_at_];
      const auto equal = std::find_if(other.full_.begin(), other.full_.end(),
                                      [&](const auto& block) { return *block == *own; });
      if (equal != other.full_.end()) own = *equal;
    }
  }

 private:
  std::vector<std::shared_ptr<const Block>> full_;
  std::vector<std::size_t> ends_;
  std::size_t num_looked_at_ = 0;  // of the full ones, whether another has the same
  Block last_{};
  std::size_t num_in_last_ = 0;
};

}  // namespace scanloc
