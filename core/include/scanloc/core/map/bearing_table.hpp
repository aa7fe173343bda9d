#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scanloc/core/map/shared_blocks.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"

namespace scanloc {

/// The bearings of a map's places, in their order.
class BearingTable {
 public:
  void push_back(const BearingGrid& bearings) {
    blocks_.last().push_back(bearings);
    blocks_.Appended(BlockHash(bearings.rings()));
  }

  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] const BearingGrid& operator[](std::size_t place) const {
    const auto [block, index] = blocks_.at(place);
    return (*block)[index];
  }

  /// Those of the place are asked for soon.
  void Prefetch(std::size_t place) const {
    const char* const grid = reinterpret_cast<const char*>(&(*this)[place]);
    __builtin_prefetch(grid);
    __builtin_prefetch(grid + sizeof(BearingGrid) - 1);
  }

  [[nodiscard]] const SharedBlocks<std::vector<BearingGrid>>& blocks() const { return blocks_; }
  /// SharedBlocks::ShareWith.
  void ShareWith(const BearingTable& other) { blocks_.ShareWith(other.blocks_); }

  friend bool operator==(const BearingTable& a, const BearingTable& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (a[i] != b[i]) return false;
    }
    return true;
  }

 private:
  SharedBlocks<std::vector<BearingGrid>> blocks_;
};

}  // namespace scanloc
