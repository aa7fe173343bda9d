#include "scanloc/core/scan/bearing_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "scan/bearing.hpp"
#include "scan/simd.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kBlock = 8;
constexpr std::size_t kDigitAtOnce = 4;
constexpr std::size_t kCellsAtOnce = std::size_t{1} << kDigitAtOnce;
constexpr std::size_t kNoRing = BearingGrid::kNumRings;  // out of reach: nothing stands there
constexpr std::size_t kNextTo = 2;
constexpr int kNumSectors = BearingGrid::kNumSectors;
constexpr std::uint16_t kNowhere = kNoRing * BearingGrid::kNumSectors;

/// Ring × 64 + sector of a block of points; beyond the last ring for those out of reach.
SCANLOC_SIMD void FindCells(const float* __restrict x_m, const float* __restrict y_m, float per_m,
                            std::int32_t* __restrict cells) {
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float ring = __builtin_sqrtf(x_m[i] * x_m[i] + y_m[i] * y_m[i]) * per_m;
    const auto bounded = static_cast<std::int32_t>(std::min(ring, static_cast<float>(kNoRing)));
    cells[i] = bounded * kNumSectors + SectorFromRear(x_m[i], y_m[i], kNumSectors);
  }
}

using GridWords = BlockCounts::Words;
using GridDigits = BlockCounts::Digits;

using FourWords = std::uint64_t __attribute__((vector_size(32)));
using EightWords = std::uint64_t __attribute__((vector_size(64)));

/// Each number of sectors as often as a block has grids: what all words of a ring are shifted by.
alignas(EightWords) constexpr auto kSectors = [] {
  std::array<GridWords, kNumSectors> sectors{};
  for (std::size_t i = 0; i < sectors.size(); ++i) sectors[i].fill(i);
  return sectors;
}();

/// Words: of some grids, side by side.
template <typename Words>
struct SideBySide {
  /// In each position, adds two bits to a third; what is carried goes to the next digit.
  static inline void AddBits(Words& sum, const Words& a, const Words& b, Words& carry) {
    const Words either = sum ^ a;
    carry = (sum & a) | (either & b);
    sum = either ^ b;
  }

  /// A cell's ring, turned back by its sector, so that its bits are turns of the query.
  static SCANLOC_INLINE Words Turned(const BearingBlock::Rings& rings, std::size_t first_grid,
                                     std::size_t cell) {
    const std::size_t sector = cell % kNumSectors;
    Words ring, back, forth;
    std::memcpy(&ring, &rings[cell / kNumSectors][first_grid], sizeof(ring));
    std::memcpy(&back, &kSectors[sector], sizeof(back));
    std::memcpy(&forth, &kSectors[(kNumSectors - sector) % kNumSectors], sizeof(forth));
    return (ring >> back) | (ring << forth);
  }

  /// Adds the rings of 2^kDigit cells to the digits up to this one; tells what it gets carried.
  template <std::size_t kDigit>
  static SCANLOC_INLINE Words Carry(const BearingBlock::Rings& rings, std::size_t first_grid,
                                    const std::uint16_t* cells, Words* digits) {
    if constexpr (kDigit == 0) {
      return Turned(rings, first_grid, *cells);
    } else {
      constexpr std::size_t kHalf = std::size_t{1} << (kDigit - 1);
      const Words first = Carry<kDigit - 1>(rings, first_grid, cells, digits);
      const Words second = Carry<kDigit - 1>(rings, first_grid, cells + kHalf, digits);
      Words carry;
      AddBits(digits[kDigit - 1], first, second, carry);
      return carry;
    }
  }

  /// Adds up 64 turns of all grids at once, as numbers in binary digits; and the greatest of each.
  static SCANLOC_INLINE void Count(const BearingBlock::Rings& rings, std::size_t first_grid,
                                   std::span<const std::uint16_t> cells, GridDigits& counts,
                                   GridWords& most) {
    Words digits[BlockCounts::kNumDigits] = {};
    for (std::size_t begin = 0; begin < cells.size(); begin += kCellsAtOnce) {
      Words carry = Carry<kDigitAtOnce>(rings, first_grid, &cells[begin], digits);
      for (std::size_t digit = kDigitAtOnce; digit < BlockCounts::kNumDigits; ++digit) {
        const Words next = carry & digits[digit];
        digits[digit] ^= carry;
        carry = next;
      }
    }
    for (std::size_t digit = 0; digit < BlockCounts::kNumDigits; ++digit) {
      std::memcpy(&counts[digit][first_grid], &digits[digit], sizeof(Words));
    }
    GridWords all;
    all.fill(~std::uint64_t{0});
    KeepBest(counts, first_grid, all, most);
  }

  /// BlockCounts::KeepBest, of some grids.
  static SCANLOC_INLINE void KeepBest(const GridDigits& counts, std::size_t first_grid,
                                      GridWords& turns, GridWords& most) {
    Words among;
    std::memcpy(&among, &turns[first_grid], sizeof(Words));
    Words greatest = {};
    for (std::size_t digit = BlockCounts::kNumDigits; digit-- > 0;) {
      Words of_digit;
      std::memcpy(&of_digit, &counts[digit][first_grid], sizeof(Words));
      const Words greater = among & of_digit;
      among = greater != Words{} ? greater : among;
      greatest |= greater != Words{} ? Words{} + (std::uint64_t{1} << digit) : Words{};
    }
    std::memcpy(&turns[first_grid], &among, sizeof(Words));
    std::memcpy(&most[first_grid], &greatest, sizeof(Words));
  }
};

SCANLOC_SIMD void CountTurned(const BearingBlock::Rings& rings,
                              std::span<const std::uint16_t> cells, GridDigits& counts,
                              GridWords& most) {
  SideBySide<FourWords>::Count(rings, 0, cells, counts, most);
  SideBySide<FourWords>::Count(rings, 4, cells, counts, most);
}

#ifdef __x86_64__
__attribute__((target("avx512f"))) void CountTurnedByAvx512(const BearingBlock::Rings& rings,
                                                            std::span<const std::uint16_t> cells,
                                                            GridDigits& counts, GridWords& most) {
  SideBySide<EightWords>::Count(rings, 0, cells, counts, most);
}
#endif

decltype(&CountTurned) FastestCount() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f")) return &CountTurnedByAvx512;
#endif
  return &CountTurned;
}

}  // namespace

BearingGrid::BearingGrid(std::span<const Post> posts, double ring_m, double aside_m) {
  const auto per_m = static_cast<float>(1.0 / ring_m);
  const auto farther_m = static_cast<float>(aside_m);
  float x_m[kBlock] = {};
  float y_m[kBlock] = {};
  std::int32_t cells[kBlock];
  for (std::size_t begin = 0; begin < posts.size(); begin += kBlock) {
    const std::size_t num_posts = std::min(kBlock, posts.size() - begin);
    for (std::size_t i = 0; i < num_posts; ++i) {
      x_m[i] = static_cast<float>(posts[begin + i].x_cm) * 0.01F;
      y_m[i] = static_cast<float>(posts[begin + i].y_cm) * 0.01F + farther_m;
    }
    FindCells(x_m, y_m, per_m, cells);
    for (std::size_t i = 0; i < num_posts; ++i) {
      const auto cell = static_cast<std::size_t>(cells[i]);
      if (cell >= kNowhere) continue;
      rings_[cell / kNumSectors] |= std::uint64_t{1} << cell % kNumSectors;
    }
  }
}

BearingGrid BearingGrid::Widened() const {
  BearingGrid wide(Rings{});
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    wide.rings_[i] = rings_[i] | std::rotl(rings_[i], 1) | std::rotr(rings_[i], 1);
  }
  return wide;
}

SCANLOC_SIMD BearingGrid::RingCounts BearingGrid::CountByRing() const {
  RingCounts counts;
  for (std::size_t i = 0; i < rings_.size(); ++i) counts[i] = std::popcount(rings_[i]);
  return counts;
}

bool BearingTurn::IsNextTo(const BearingTurn& other) const {
  const std::size_t apart = (sectors - other.sectors) % BearingGrid::kNumSectors;
  return std::min(apart, BearingGrid::kNumSectors - apart) <= kNextTo;
}

double BearingTurn::heading_rad() const {
  constexpr double kSector_rad = 2.0 * std::numbers::pi / BearingGrid::kNumSectors;
  return WrapAngle(static_cast<double>(sectors) * kSector_rad);
}

SCANLOC_SIMD void BlockCounts::KeepBest(const Digits& digits, Words& turns, Words& counts) {
  SideBySide<FourWords>::KeepBest(digits, 0, turns, counts);
  SideBySide<FourWords>::KeepBest(digits, 4, turns, counts);
}

std::uint64_t BlockCounts::SectorsNextTo(const BearingTurn& turn) {
  return std::rotl((std::uint64_t{1} << (2 * kNextTo + 1)) - 1U,
                   static_cast<int>(turn.sectors) - static_cast<int>(kNextTo));
}

int BlockCounts::Of(std::size_t grid, std::size_t sectors) const {
  int count = 0;
  for (std::size_t digit = 0; digit < kNumDigits; ++digit) {
    count += static_cast<int>((digits_[digit][grid] >> sectors) & 1U) << digit;
  }
  return count;
}

void BearingBlock::Add(const BearingGrid& grid) {
  const BearingGrid::RingCounts counts = grid.CountByRing();
  for (std::size_t ring = 0; ring < BearingGrid::kNumRings; ++ring) {
    rings_[ring][size_] = grid.rings()[ring];
    ring_counts_[ring][size_] = counts[ring];
  }
  ++size_;
}

BearingQuery::BearingQuery(const BearingGrid& grid) : ring_counts_(grid.CountByRing()) {
  for (std::size_t ring = 0; ring < BearingGrid::kNumRings; ++ring) {
    for (std::uint64_t left = grid.rings()[ring]; left != 0U; left &= left - 1U) {
      cells_.push_back(static_cast<std::uint16_t>(
          ring * BearingGrid::kNumSectors + static_cast<std::size_t>(std::countr_zero(left))));
    }
  }
  cells_.resize((cells_.size() + kCellsAtOnce - 1) / kCellsAtOnce * kCellsAtOnce, kNowhere);
}

BlockCounts BearingQuery::Count(const BearingBlock& block) const {
  static const auto kCount = FastestCount();
  BlockCounts counts;
  kCount(block.rings(), cells_, counts.digits_, counts.most_);
  return counts;
}

std::vector<double> AgreeingHeadings(std::span<const Post> place, std::span<const Post> query,
                                     double ring_m, std::size_t max_headings) {
  BearingBlock block;
  block.Add(BearingGrid(place, ring_m).Widened());
  std::vector<double> headings;
  BearingQuery(BearingGrid(query, ring_m))
      .Count(block)
      .VisitBest(max_headings, [&](std::size_t /*grid*/, const BearingTurn& turn) {
        headings.push_back(turn.heading_rad());
      });
  return headings;
}

}  // namespace scanloc
