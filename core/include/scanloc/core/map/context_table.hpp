#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "scanloc/core/map/shared_blocks.hpp"
#include "scanloc/core/scan/descriptor.hpp"

namespace scanloc {

/// The two sub-descriptors of a context (paper, Sec. IV-F), both L1 norms in centimetres.
struct Keys {
  std::vector<std::int32_t> retrieval_cm;  ///< N_R, one per row: unchanged by column shifts
  std::vector<std::int32_t> aligning_cm;   ///< N_A, one per column

  friend bool operator==(const Keys&, const Keys&) = default;
};
[[nodiscard]] Keys MakeKeys(const Context& context);

/// A context and its aligning key, wherever they are held: what matching looks at.
struct ContextView {
  int num_rows = 0;
  int num_cols = 0;
  std::span<const std::uint16_t> cells_cm;
  std::span<const std::int32_t> aligning_cm;
};

/// Retrieval keys, one behind the other.
struct KeyBlock {
  std::vector<std::uint16_t> cm;
  /// Few sums do not fit into 16 bits; the keys of those are kept apart, by their number here.
  std::map<std::size_t, std::vector<std::int32_t>> large_cm;

  friend bool operator==(const KeyBlock&, const KeyBlock&) = default;
};

/// All contexts of one kind in a map, originals and augmented ones, with their keys, or the
/// retrieval keys alone where the contexts stay in a file (PayloadReader); structure of arrays. An
/// entry is one context; the entries of a place share its index and follow each other.
class ContextTable {
 public:
  /// What an entry says of the place.
  struct Entry {
    std::int32_t place = 0;     ///< index of the place in the map
    float root_shift_m = 0.0F;  ///< lateral position of the virtual vehicle, A-PC
    bool flipped = false;       ///< the place as seen by the reversed vehicle, A-CC
    bool augmented = false;     ///< not the place's own context
  };

  /// Distinct entries but for the place, at most.
  static constexpr std::size_t kMaxVariants = 256;
  static constexpr std::int32_t kMaxPlace = (1 << 24) - 1;

  ContextTable() = default;
  ContextTable(int num_rows, int num_cols) : num_rows_(num_rows), num_cols_(num_cols) {}

  /// num_entries counts flips, too.
  void Reserve(std::size_t num_entries, bool with_contexts);

  /// Requires context cells and keys of the table's shape, the same kind of Append for all entries,
  /// and an entry within the bounds above.
  void Append(const Entry& entry, std::span<const std::uint16_t> cells_cm,
              std::span<const std::int32_t> retrieval_cm,
              std::span<const std::int32_t> aligning_cm);
  /// Without its context, which stays in a file.
  void AppendKey(const Entry& entry, std::span<const std::int32_t> retrieval_cm);

  /// Appends the last entry's double flip (paper, Sec. V-D2), as augmented. In a table either every
  /// second entry is so appended, or none.
  void AppendFlipOfLast();
  /// Every second entry is the flip of the one before.
  [[nodiscard]] bool has_flips() const { return num_flips_ > 0; }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] int num_rows() const { return num_rows_; }
  [[nodiscard]] int num_cols() const { return num_cols_; }
  /// False: retrieval keys alone.
  [[nodiscard]] bool holds_contexts() const { return cells_cm_.size() == size() * num_cells(); }
  [[nodiscard]] Entry entry(std::size_t i) const;
  /// Requires holds_contexts().
  [[nodiscard]] ContextView context(std::size_t i) const;
  [[nodiscard]] std::vector<std::int32_t> retrieval_key_cm(std::size_t i) const;
  /// The same into num_rows() values.
  void ReadRetrievalKey(std::size_t i, std::span<std::int32_t> key_cm) const;
  /// An entry's key as the table has it, without a copy: of a flip reversed, and none where a sum
  /// does not fit into 16 bits.
  struct HeldKey {
    std::span<const std::uint16_t> cm;
    bool is_reversed = false;
  };
  [[nodiscard]] HeldKey held_retrieval_key(std::size_t i) const;
  /// The entry's key is asked for soon.
  void Prefetch(std::size_t i) const {
    const HeldKey held = held_retrieval_key(i);
    if (held.cm.empty()) return;
    __builtin_prefetch(held.cm.data());
    __builtin_prefetch(&held.cm.back());
  }
  /// The keys that are held: of all entries, or of all that are no flips.
  [[nodiscard]] const SharedBlocks<KeyBlock>& key_blocks() const { return keys_; }
  /// SharedBlocks::ShareWith, of the keys.
  void ShareKeysWith(const ContextTable& other) {
    if (num_rows_ == other.num_rows_) keys_.ShareWith(other.keys_);
  }

 private:
  [[nodiscard]] std::size_t num_cells() const {
    return static_cast<std::size_t>(num_rows_) * static_cast<std::size_t>(num_cols_);
  }
  void AppendOwner(const Entry& entry);
  /// Of the entry, as owners_ has it.
  [[nodiscard]] std::uint32_t OwnerOf(std::size_t i) const;
  /// Of the key of an entry among those that are held.
  [[nodiscard]] std::size_t NumberOf(std::size_t entry) const {
    return has_flips() ? entry / 2 : entry;
  }

  int num_rows_ = 0;
  int num_cols_ = 0;
  std::size_t size_ = 0;
  std::vector<Entry> variants_;  // as place 0
  /// An entry's place, and in the upper 8 bits its variant; empty as long as each place from 0 on
  /// has one entry of each variant, in their order.
  std::vector<std::uint32_t> owners_;
  std::vector<std::uint16_t> cells_cm_;
  std::size_t num_flips_ = 0;  // whose keys are not held
  SharedBlocks<KeyBlock> keys_;
  std::vector<std::int32_t> aligning_cm_;
};

}  // namespace scanloc
