#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace scanloc {

/// Static trees over a sequence that grows at its end: Bentley and Saxe's logarithmic method. Each
/// tree covers a range of the sequence, longer than that of the next; what is too short for a tree
/// at the end is left to whoever searches.
template <typename Tree>
class Forest {
 public:
  /// Covers a sequence of now `size` elements, but for fewer than min_length at its end;
  /// make(begin, end) gives a std::unique_ptr<const Tree> over a range. Every element is built into
  /// O(log size) trees in all.
  template <typename Make>
  void Grow(std::size_t size, std::size_t min_length, Make&& make) {
    if (size < covered() + min_length) return;
    std::size_t begin = covered();
    while (!trees_.empty() && trees_.back().end - trees_.back().begin <= size - begin) {
      begin = trees_.back().begin;
      trees_.pop_back();
    }
    trees_.push_back({begin, size, make(begin, size)});
  }

  /// Elements from here on are in no tree.
  [[nodiscard]] std::size_t covered() const { return trees_.empty() ? 0 : trees_.back().end; }

  /// Calls visit(tree, begin) for each, the longest first.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const Grown& grown : trees_) visit(*grown.tree, grown.begin);
  }

 private:
  struct Grown {
    std::size_t begin;
    std::size_t end;
    std::unique_ptr<const Tree> tree;
  };
  std::vector<Grown> trees_;
};

}  // namespace scanloc
