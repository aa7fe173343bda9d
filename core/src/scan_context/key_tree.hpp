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
class KeyTree {
 public:
  /// A leaf is scanned from front to back: sixteen keys side by side cost less than finding out
  /// which of them to leave out.
  static constexpr std::size_t kLeafSize = 512;

  /// Over a range of entries that is not empty. O(n log n).
  KeyTree(const ContextTable& table, KeyScale scale, std::size_t begin, std::size_t end);

  /// Adds whatever may be among the nearest.
  void Search(std::span<const std::int32_t> key_cm, NearestPlaces& nearest) const;

 private:
  /// Components of a key that the tree cuts; they are ordered by variance, and eight have nearly
  /// all of it.
  static constexpr std::size_t kNumLead = 8;
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  struct Keys;
  struct Interval {
    float low = std::numeric_limits<float>::infinity();
    float high = -std::numeric_limits<float>::infinity();
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

  void SetReach(Walk& walk) const;
  void AddBatch(std::size_t batch, Walk& walk) const;
  [[nodiscard]] float SquaredDistance(std::size_t row, const std::vector<float>& key) const;
  /// Visits what of the subtree may hold nearer keys, the nearer child first. `distance` is the sum
  /// of the gaps, a lower bound of the squared distance to any key of the subtree.
  void Visit(std::size_t node, float distance, Walk& walk) const;

  PrincipalAxes axes_;
  KeyBatches batches_;
  std::vector<std::uint32_t> owners_;  // entries, by row of the batches
  std::vector<float> rows_;            // the keys, one behind the other
  std::vector<Node> nodes_;            // the root first
  Box box_;
  float greatest_norm_ = 0.0F;
};

}  // namespace scanloc
