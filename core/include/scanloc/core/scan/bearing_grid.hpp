#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan/structure.hpp"

namespace scanloc {

class TurnedBearings;

/// Where upright things stand around a sensor, in rings and 64 sectors, a bit each: small enough to
/// be turned against another in every direction in less than a microsecond. Sectors that one side
/// does not see cost nothing, unlike in a comparison of descriptors.
class BearingGrid {
 public:
  static constexpr int kNumSectors = 64;
  static constexpr int kNumRings = 15;

  /// A bit a sector, sectors counted from the rear, counter-clockwise; a word a ring, the innermost
  /// first.
  using Rings = std::array<std::uint64_t, kNumRings>;

  BearingGrid(std::span<const Post> posts, double ring_m);
  explicit BearingGrid(const Rings& rings) : rings_(rings) {}

  [[nodiscard]] const Rings& rings() const { return rings_; }

  /// The same with every thing one sector wider to either side.
  [[nodiscard]] BearingGrid Widened() const;

  /// Rings' sectors in which something stands.
  [[nodiscard]] int num_sectors() const;

  /// How many rings' sectors agree when the query is turned by so many sectors, counter-clockwise;
  /// an element a turn.
  using Agreement = std::array<int, kNumSectors>;
  [[nodiscard]] Agreement AgreementByTurn(const TurnedBearings& query) const;

  /// Headings of the query in this grid's frame [rad] where most agrees, best first; neighbouring
  /// directions count as one.
  [[nodiscard]] static std::vector<double> BestHeadings(Agreement agreement, int max_headings);
  [[nodiscard]] std::vector<double> BestHeadings(const BearingGrid& query, int max_headings) const;

  friend bool operator==(const BearingGrid&, const BearingGrid&) = default;

 private:
  friend class TurnedBearings;

  Rings rings_{};
};

/// A query's grid in every direction, made once for all places.
class TurnedBearings {
 public:
  explicit TurnedBearings(const BearingGrid& query);

  [[nodiscard]] int num_sectors() const { return num_sectors_; }

 private:
  friend class BearingGrid;

  // By ring, then by turn.
  std::array<std::array<std::uint64_t, BearingGrid::kNumSectors>, BearingGrid::kNumRings> rings_;
  int num_sectors_;
};

}  // namespace scanloc
