#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scan_context/key_tree.hpp"
#include "scan_context/nearest_places.hpp"

namespace scanloc {

/// One search through the trees of a table, as if they were one: the leaves that are nearest to the
/// key first, whichever tree they are of.
class KeySearch {
 public:
  /// The tree of the table's entries from `begin` on.
  struct Part {
    const KeyTree* tree = nullptr;
    std::size_t begin = 0;
  };

  /// Requires trees of one table; keeps references to the parts and to `nearest`.
  KeySearch(std::span<const Part> parts, std::span<const std::int32_t> key_cm,
            NearestPlaces& nearest);

  /// Adds whatever may be among the nearest.
  void Run();

 private:
  /// The key as a tree has it, or the reversed one, with which its flips are found.
  struct Turned {
    const Part* part = nullptr;
    KeyBatches::Query key;
    std::uint32_t flip = 0;        // 1: the reversed one
    std::uint32_t first_leaf = 0;  // of its tree's leaves among those of all
  };
  /// A squared distance, and what it is of: a leaf, or an entry.
  struct Ranked {
    float distance = 0.0F;
    std::uint32_t what = 0;
    friend auto operator<=>(const Ranked&,
                            const Ranked&) = default;  // NOLINT(modernize-use-nullptr)
  };

  /// Returns the key's length.
  float Add(const Part& part, std::span<const std::int32_t> key_cm, std::uint32_t flip);
  void SetLimit();
  /// Makes candidates of what may be near.
  void ScanLeaf(const Turned& turned, const KeyTree::Leaf& leaf);
  /// Compares the candidates in full.
  void Settle();

  const std::size_t patience_;  // so many candidates are looked at together
  NearestPlaces& nearest_;
  std::vector<Turned> turned_;
  std::vector<Ranked> leaves_;  // those not looked at yet, a heap
  float slack_ = 0.0F;          // by which a distance may look greater than it is
  float limit_;                 // what looks farther is of no interest
  std::vector<Ranked> candidates_;
};

}  // namespace scanloc
