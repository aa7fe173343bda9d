#pragma once

#include <array>
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

/// In how many rings' sectors two grids agree when one is turned by so many sectors,
/// counter-clockwise; of all turns at once.
class TurnCounts {
 public:
  static constexpr std::size_t kNumDigits = 10;  // up to 15 × 64

  struct Turn {
    std::size_t sectors = 0;
    int count = 0;

    /// Whether they are within two sectors of each other.
    [[nodiscard]] bool IsNextTo(const Turn& other) const;
  };
  /// The turn with most, of those whose bit is set in `among`; the lowest of several.
  [[nodiscard]] Turn Most(std::uint64_t among = ~std::uint64_t{0}) const;
  /// The turns with most, best first; those next to each other (two sectors) count as one, and
  /// none is told without anything that agrees.
  [[nodiscard]] std::vector<Turn> Best(std::size_t max_turns) const;
  [[nodiscard]] int operator[](std::size_t turn) const;

 private:
  friend class BlockCounts;

  // A count in binary digits: a word a digit, a bit a turn.
  std::array<std::uint64_t, kNumDigits> digits_{};
};

/// A turn as an angle in (-π, π].
[[nodiscard]] double HeadingOf(const TurnCounts::Turn& turn);

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

/// How a query agrees with each grid of a block.
class BlockCounts {
 public:
  [[nodiscard]] TurnCounts Of(std::size_t grid) const;
  /// Of TurnCounts::Most.
  [[nodiscard]] int MostOf(std::size_t grid) const { return static_cast<int>(most_[grid]); }

 private:
  friend class BearingQuery;

  using Words = std::array<std::uint64_t, BearingBlock::kSize>;
  alignas(64) std::array<Words, TurnCounts::kNumDigits> digits_;  // likewise, a word a grid
  alignas(64) Words most_;
};

/// A query's grid, made ready to be turned against many.
class BearingQuery {
 public:
  explicit BearingQuery(const BearingGrid& grid);

  [[nodiscard]] const BearingGrid::RingCounts& ring_counts() const { return ring_counts_; }

  [[nodiscard]] BlockCounts Count(const BearingBlock& block) const;
  [[nodiscard]] TurnCounts Count(const BearingGrid& grid) const;

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
