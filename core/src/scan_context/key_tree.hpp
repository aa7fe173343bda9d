#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "scan_context/key_batches.hpp"
#include "scan_context/principal_axes.hpp"
#include "scanloc/core/map/context_table.hpp"

namespace scanloc {

/// A k-d tree over the retrieval keys of some entries of a table, with large leaves, in which a
/// processor compares many keys side by side. Immutable; does not refer to the table, and knows
/// entries by how far they are behind its first: it is that of equal keys in any table.
///
/// Holds the leading components of each key along its axes, 16 bits each: enough to pass over
/// nearly all that is not near (KeySearch). Of a table with flips (ContextTable::has_flips) only
/// the others are held, and searched for the reversed key, too.
///
/// Of the tree only the leaves are kept, with the box that the keys of each fill: these are so few
/// that looking at all of them, nearest first, costs less than a descent that meets them in
/// another order.
class KeyTree {
 public:
  /// A leaf is scanned from front to back: sixteen keys side by side cost less than finding out
  /// which of them to leave out.
  static constexpr std::size_t kLeafSize = 512;

  /// Over a range of entries that is not empty, and does not part an entry from its flip. O(n log
  /// n).
  KeyTree(const ContextTable& table, std::size_t begin, std::size_t end);

 private:
  friend class KeySearch;

  /// Most components that are held; ordered by variance, they have nearly all of it.
  static constexpr std::size_t kMaxHeld = 32;
  /// Of these, those that the tree cuts.
  static constexpr std::size_t kNumLead = 8;
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  struct Keys;
  struct Interval {
    std::int32_t low = std::numeric_limits<std::int16_t>::max();
    std::int32_t high = std::numeric_limits<std::int16_t>::min();
  };
  /// What keys span, component by component.
  using Box = std::array<Interval, kMaxHeld>;

  struct Leaf {
    std::uint32_t first_batch = 0;
    std::uint32_t num_batches = 0;
  };
  /// The boxes of sixteen leaves, component by component side by side.
  struct Boxes {
    std::array<std::int16_t, 16 * kMaxHeld> low{};
    std::array<std::int16_t, 16 * kMaxHeld> high{};
  };

  /// Of the first components, a multiple of eight.
  static Box BoxOf(const Keys& keys, std::span<const std::uint32_t> entries,
                   std::size_t num_components);
  /// Cuts the widest component in its middle until few enough keys are left for a leaf.
  void Build(const Keys& keys, std::span<std::uint32_t> entries);
  /// In batches of KeyBatches::kNumLanes; the last one is filled up with rows that nobody owns.
  void AppendLeaf(const Keys& keys, std::span<const std::uint32_t> entries);

  /// A key as the batches hold theirs, and its length.
  struct Turned {
    KeyBatches::Query key;
    float norm = 0.0F;
  };
  [[nodiscard]] Turned TurnedKey(std::span<const std::int32_t> key_cm) const;
  /// The leaves' distances from a key, lower bounds of those of their keys, squared, as the batches
  /// tell them.
  [[nodiscard]] std::vector<std::int32_t> BoundsOf(const KeyBatches::Query& key) const;

  std::size_t num_held_;  // four fifths of a key, for in what is left keys are all alike
  bool has_flips_;
  PrincipalAxes axes_;
  KeyBatches batches_;
  std::vector<std::uint32_t> owners_;  // entries behind the first, by row of the batches
  std::vector<Leaf> leaves_;
  std::vector<Boxes> boxes_;  // of the leaves, in their order
  float greatest_norm_ = 0.0F;
};

}  // namespace scanloc
