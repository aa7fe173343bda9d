#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "scan_context/key_batches.hpp"
#include "scan_context/nearest_places.hpp"
#include "scan_context/principal_axes.hpp"
#include "scanloc/core/map/context_table.hpp"

namespace scanloc {

/// A k-d tree over the retrieval keys of some entries of a table, with large leaves, in which a
/// processor compares many keys side by side. Immutable; does not refer to the table.
///
/// Holds the leading components of each key along its axes, 16 bits each: enough to pass over
/// nearly all that is not near. What is left is compared exactly, by the table's keys. Of a table
/// with flips (ContextTable::has_flips) only the others are held, and searched for the reversed
/// key, too.
class KeyTree {
 public:
  /// A leaf is scanned from front to back: sixteen keys side by side cost less than finding out
  /// which of them to leave out.
  static constexpr std::size_t kLeafSize = 512;

  /// Over a range of entries that is not empty, and does not part an entry from its flip. O(n log
  /// n).
  KeyTree(const ContextTable& table, KeyScale scale, std::size_t begin, std::size_t end);

  /// Adds whatever may be among the nearest.
  void Search(std::span<const std::int32_t> key_cm, NearestPlaces& nearest) const;

 private:
  /// Components that are held; ordered by variance, they have nearly all of it.
  static constexpr std::size_t kNumHeld = 16;
  /// Of these, those that the tree cuts.
  static constexpr std::size_t kNumLead = 8;
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  struct Keys;
  struct Interval {
    std::int32_t low = std::numeric_limits<std::int16_t>::max();
    std::int32_t high = std::numeric_limits<std::int16_t>::min();
  };
  /// What of the leading components keys span.
  using Box = std::array<Interval, kNumLead>;

  /// A leaf has no second child; the first child of an inner node follows it.
  struct Node {
    std::uint32_t second = 0;
    std::uint32_t component = 0;  // where it is cut
    Interval gap;                 // no key lies in it: the first child ends, the second begins
    std::uint32_t first_batch = 0;
    std::uint32_t num_batches = 0;
  };

  /// One search under way.
  struct Walk;

  static Box BoxOf(const Keys& keys, std::span<const std::uint32_t> entries);
  /// Cuts the widest component in its middle until few enough keys are left for a leaf.
  void Build(const Keys& keys, std::span<std::uint32_t> entries, const Box& box);
  /// In batches of KeyBatches::kNumLanes; the last one is filled up with rows that nobody owns.
  void AppendLeaf(const Keys& keys, std::span<const std::uint32_t> entries);

  /// One walk; adds what lies `offset` behind the entries that it finds.
  void SearchFor(std::span<const std::int32_t> key_cm, std::uint32_t offset,
                 NearestPlaces& nearest) const;
  void SetReach(Walk& walk) const;
  void AddBatch(std::size_t batch, Walk& walk) const;
  /// Visits what of the subtree may hold nearer keys, the nearer child first. `distance` is the sum
  /// of the gaps, a lower bound of the squared distance to any key of the subtree.
  void Visit(std::size_t node, std::int32_t distance, Walk& walk) const;

  std::size_t num_held_;
  bool has_flips_;
  PrincipalAxes axes_;
  KeyBatches batches_;
  std::vector<std::uint32_t> owners_;  // entries, by row of the batches
  std::vector<Node> nodes_;            // the root first
  Box box_;
  float greatest_norm_ = 0.0F;
};

}  // namespace scanloc
