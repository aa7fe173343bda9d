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

/// A word a grid of a block, and those of each binary digit.
using GridWords = std::array<std::uint64_t, BearingBlock::kSize>;
using GridDigits = std::array<GridWords, TurnCounts::kNumDigits>;

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

  /// Adds the rings' words, each turned back by a cell's sector so that its bits are turns of the
  /// query: 64 turns of all grids at once, as numbers in binary digits; and the greatest of each.
  static inline __attribute__((always_inline)) void Count(const BearingBlock::Rings& rings,
                                                          std::size_t first_grid,
                                                          std::span<const std::uint16_t> cells,
                                                          GridDigits& counts, GridWords& most) {
    Words digits[TurnCounts::kNumDigits] = {};
    Words ones = {};
    Words twos = {};
    Words fours = {};
    for (std::size_t begin = 0; begin < cells.size(); begin += kBlock) {
      Words turned[kBlock];
      for (std::size_t i = 0; i < kBlock; ++i) {
        const std::size_t cell = cells[begin + i];
        const std::size_t sector = cell % kNumSectors;
        Words ring, back, forth;
        std::memcpy(&ring, &rings[cell / kNumSectors][first_grid], sizeof(ring));
        std::memcpy(&back, &kSectors[sector], sizeof(back));
        std::memcpy(&forth, &kSectors[(kNumSectors - sector) % kNumSectors], sizeof(forth));
        turned[i] = (ring >> back) | (ring << forth);
      }
      Words carry_twos[4];
      Words carry_fours[2];
      Words eights;
      for (std::size_t i = 0; i < 4; ++i) {
        AddBits(ones, turned[2 * i], turned[2 * i + 1], carry_twos[i]);
      }
      for (std::size_t i = 0; i < 2; ++i) {
        AddBits(twos, carry_twos[2 * i], carry_twos[2 * i + 1], carry_fours[i]);
      }
      AddBits(fours, carry_fours[0], carry_fours[1], eights);
      for (std::size_t digit = 3; digit < TurnCounts::kNumDigits; ++digit) {
        const Words carry = digits[digit] & eights;
        digits[digit] ^= eights;
        eights = carry;
      }
    }
    digits[0] = ones;
    digits[1] = twos;
    digits[2] = fours;
    Words among = ~Words{};
    Words greatest = {};
    for (std::size_t digit = TurnCounts::kNumDigits; digit-- > 0;) {
      const Words greater = among & digits[digit];
      among = greater != Words{} ? greater : among;
      greatest |= greater != Words{} ? Words{} + (std::uint64_t{1} << digit) : Words{};
      std::memcpy(&counts[digit][first_grid], &digits[digit], sizeof(Words));
    }
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

bool TurnCounts::Turn::IsNextTo(const Turn& other) const {
  const std::size_t apart = (sectors - other.sectors) % BearingGrid::kNumSectors;
  return std::min(apart, BearingGrid::kNumSectors - apart) <= kNextTo;
}

TurnCounts::Turn TurnCounts::Most(std::uint64_t among) const {
  Turn most;
  for (std::size_t digit = kNumDigits; digit-- > 0;) {
    // No branch: digits cannot be predicted.
    const std::uint64_t greater = among & digits_[digit];
    among = greater != 0U ? greater : among;
    most.count |= (greater != 0U ? 1 : 0) << digit;
  }
  most.sectors = static_cast<std::size_t>(std::countr_zero(among)) % BearingGrid::kNumSectors;
  return most;
}

std::vector<TurnCounts::Turn> TurnCounts::Best(std::size_t max_turns) const {
  std::vector<Turn> best;
  best.reserve(max_turns);
  std::uint64_t among = ~std::uint64_t{0};
  while (best.size() < max_turns && among != 0U) {
    const Turn most = Most(among);
    if (most.count == 0) break;
    best.push_back(most);
    among &= ~std::rotl((std::uint64_t{1} << (2 * kNextTo + 1)) - 1U,
                        static_cast<int>(most.sectors) - static_cast<int>(kNextTo));
  }
  return best;
}

int TurnCounts::operator[](std::size_t turn) const {
  int count = 0;
  for (std::size_t digit = 0; digit < kNumDigits; ++digit) {
    count += static_cast<int>((digits_[digit] >> turn) & 1U) << digit;
  }
  return count;
}

double HeadingOf(const TurnCounts::Turn& turn) {
  constexpr double kSector_rad = 2.0 * std::numbers::pi / BearingGrid::kNumSectors;
  return WrapAngle(static_cast<double>(turn.sectors) * kSector_rad);
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
  cells_.resize((cells_.size() + kBlock - 1) / kBlock * kBlock, kNowhere);
}

BlockCounts BearingQuery::Count(const BearingBlock& block) const {
  static const auto kCount = FastestCount();
  BlockCounts counts;
  kCount(block.rings(), cells_, counts.digits_, counts.most_);
  return counts;
}

TurnCounts BearingQuery::Count(const BearingGrid& grid) const {
  BearingBlock block;
  block.Add(grid);
  return Count(block).Of(0);
}

TurnCounts BlockCounts::Of(std::size_t grid) const {
  TurnCounts counts;
  for (std::size_t digit = 0; digit < TurnCounts::kNumDigits; ++digit) {
    counts.digits_[digit] = digits_[digit][grid];
  }
  return counts;
}

std::vector<double> AgreeingHeadings(std::span<const Post> place, std::span<const Post> query,
                                     double ring_m, std::size_t max_headings) {
  const BearingQuery bearings(BearingGrid(query, ring_m));
  std::vector<double> headings;
  for (const TurnCounts::Turn& turn :
       bearings.Count(BearingGrid(place, ring_m).Widened()).Best(max_headings)) {
    headings.push_back(HeadingOf(turn));
  }
  return headings;
}

}  // namespace scanloc
