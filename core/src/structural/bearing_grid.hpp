#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan/structure.hpp"

namespace scanloc {

/// Where upright things stand around a sensor, in rings and 64 sectors, a bit each: small enough to
/// be turned against another in every direction in less than a microsecond. Sectors that one side
/// does not see cost nothing, unlike in a comparison of descriptors.
class BearingGrid {
 public:
  static constexpr int kNumSectors = 64;
  static constexpr int kNumRings = 15;

  BearingGrid(std::span<const Post> posts, double ring_m);

  /// The same with every thing one sector wider to either side.
  [[nodiscard]] BearingGrid Widened() const;

  /// How many rings' sectors agree when the query is turned by so many sectors, counter-clockwise;
  /// an element a turn.
  using Agreement = std::array<int, kNumSectors>;
  [[nodiscard]] Agreement AgreementByTurn(const BearingGrid& query) const;

  /// Headings of the query in this grid's frame [rad] where most agrees, best first; neighbouring
  /// directions count as one.
  [[nodiscard]] std::vector<double> BestHeadings(const BearingGrid& query, int max_headings) const;

 private:
  BearingGrid() = default;

  std::array<std::uint64_t, kNumRings> rings_{};
};

}  // namespace scanloc
