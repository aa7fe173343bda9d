#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan/structure.hpp"

namespace scanloc {

/// Where upright things stand around a spot, in rings and 64 sectors, a bit each: small enough to
/// be turned against another in every direction in a tenth of a microsecond. Sectors that one side
/// does not see cost nothing, unlike in a comparison of descriptors.
class BearingGrid {
 public:
  static constexpr std::size_t kNumSectors = 64;
  static constexpr std::size_t kNumRings = 15;

  /// A bit a sector, sectors counted from the rear, counter-clockwise; a word a ring, the innermost
  /// first.
  using Rings = std::array<std::uint64_t, kNumRings>;

  /// Around where the posts lie the given distance farther to the left.
  BearingGrid(std::span<const Post> posts, double ring_m, double aside_m = 0.0);
  explicit BearingGrid(const Rings& rings) : rings_(rings) {}

  [[nodiscard]] const Rings& rings() const { return rings_; }

  /// The same with every thing one sector wider to either side.
  [[nodiscard]] BearingGrid Widened() const;

  /// In how many sectors of each ring something stands.
  using RingCounts = std::array<int, kNumRings>;
  [[nodiscard]] RingCounts CountByRing() const;

  friend bool operator==(const BearingGrid&, const BearingGrid&) = default;

 private:
  Rings rings_{};
};

/// A grid turned by so many sectors, counter-clockwise, and in how many rings' sectors it agrees so
/// with another.
struct BearingTurn {
  std::size_t sectors = 0;
  int count = 0;

  /// Whether they are within two sectors of each other.
  [[nodiscard]] bool IsNextTo(const BearingTurn& other) const;
  /// As an angle in (-π, π].
  [[nodiscard]] double heading_rad() const;
};

/// Grids side by side, so that a query is turned against all of them at once.
class BearingBlock {
 public:
  static constexpr std::size_t kSize = 8;

  /// Requires room.
  void Add(const BearingGrid& grid);
  [[nodiscard]] std::size_t size() const { return size_; }

  /// Behind the innermost ring the next; in each a word a grid, zeros where there is none. The last
  /// is beyond all rings: nothing stands there.
  using Rings = std::array<std::array<std::uint64_t, kSize>, BearingGrid::kNumRings + 1>;
  [[nodiscard]] const Rings& rings() const { return rings_; }
  /// BearingGrid::CountByRing, likewise.
  using RingCounts = std::array<std::array<int, kSize>, BearingGrid::kNumRings>;
  [[nodiscard]] const RingCounts& ring_counts() const { return ring_counts_; }

 private:
  alignas(64) Rings rings_{};
  alignas(64) RingCounts ring_counts_{};
  std::size_t size_ = 0;
};

/// How a query agrees with each grid of a block, in all turns.
class BlockCounts {
 public:
  static constexpr std::size_t kNumDigits = 10;  // up to 15 × 64
  /// A word a grid.
  using Words = std::array<std::uint64_t, BearingBlock::kSize>;
  using Digits = std::array<Words, kNumDigits>;

  [[nodiscard]] int Of(std::size_t grid, std::size_t sectors) const;
  [[nodiscard]] int MostOf(std::size_t grid) const { return static_cast<int>(most_[grid]); }

  /// visit(number of a grid, BearingTurn): of each grid the turns with most, best first, of equal
  /// ones the lowest; those next to each other count as one, and none is told without anything that
  /// agrees.
  template <typename Visitor>
  void VisitBest(std::size_t max_turns, Visitor&& visit) const {
    Words left;
    left.fill(~std::uint64_t{0});
    for (std::size_t n = 0; n < max_turns; ++n) {
      Words best = left;
      Words counts;
      KeepBest(digits_, best, counts);
      for (std::size_t grid = 0; grid < BearingBlock::kSize; ++grid) {
        if (counts[grid] == 0U) continue;
        const BearingTurn turn{static_cast<std::size_t>(std::countr_zero(best[grid])),
                               static_cast<int>(counts[grid])};
        visit(grid, turn);
        left[grid] &= ~SectorsNextTo(turn);
      }
    }
  }

 private:
  friend class BearingQuery;

  /// Leaves those of each grid's turns, a bit each, with most; and tells how much that is.
  static void KeepBest(const Digits& digits, Words& turns, Words& counts);
  static std::uint64_t SectorsNextTo(const BearingTurn& turn);

  alignas(64) Digits digits_;  // counts in binary digits: of each grid's word a bit a turn
  alignas(64) Words most_;
};

/// A query's grid, made ready to be turned against many.
class BearingQuery {
 public:
  explicit BearingQuery(const BearingGrid& grid);

  [[nodiscard]] const BearingGrid::RingCounts& ring_counts() const { return ring_counts_; }

  [[nodiscard]] BlockCounts Count(const BearingBlock& block) const;

 private:
  BearingGrid::RingCounts ring_counts_;
  std::vector<std::uint16_t> cells_;  // ring × 64 + sector, filled up to whole blocks
};

/// Headings of a query in the place's frame [rad] in which most posts of both stand in the same
/// directions, best first.
[[nodiscard]] std::vector<double> AgreeingHeadings(std::span<const Post> place,
                                                   std::span<const Post> query, double ring_m,
                                                   std::size_t max_headings);

}  // namespace scanloc
