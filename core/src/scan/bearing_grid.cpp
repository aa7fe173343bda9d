#include "scanloc/core/scan/bearing_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "scan/bearing.hpp"
#include "scan/simd.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {
namespace {

constexpr double kSector_rad = 2.0 * std::numbers::pi / BearingGrid::kNumSectors;

/// Three bits added up, in each of 64 positions.
struct Carried {
  std::uint64_t sum = 0;
  std::uint64_t carry = 0;
};

inline Carried AddBits(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  const std::uint64_t either = a ^ b;
  return {either ^ c, (a & b) | (either & c)};
}

}  // namespace

BearingGrid::BearingGrid(std::span<const Post> posts, double ring_m) {
  const auto ring = static_cast<float>(ring_m);
  for (const Post& post : posts) {
    const float x_m = static_cast<float>(post.x_cm) * 0.01F;
    const float y_m = static_cast<float>(post.y_cm) * 0.01F;
    const auto index = static_cast<std::size_t>(std::sqrt(x_m * x_m + y_m * y_m) / ring);
    if (index >= rings_.size()) continue;
    rings_[index] |= std::uint64_t{1} << SectorFromRear(x_m, y_m, kNumSectors);
  }
}

BearingGrid BearingGrid::Widened() const {
  BearingGrid wide(Rings{});
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    wide.rings_[i] = rings_[i] | std::rotl(rings_[i], 1) | std::rotr(rings_[i], 1);
  }
  return wide;
}

int BearingGrid::num_sectors() const {
  int count = 0;
  for (const std::uint64_t ring : rings_) count += std::popcount(ring);
  return count;
}

SCANLOC_SIMD BearingGrid::Agreement BearingGrid::AgreementByTurn(
    const TurnedBearings& query) const {
  // How many rings agree in a sector, as a number of four binary digits in four words: fifteen bits
  // are added by eleven full adders, for several turns at once.
  static_assert(kNumRings == 15);
  std::array<std::array<std::uint64_t, kNumSectors>, 4> digits;
  for (std::size_t turn = 0; turn < kNumSectors; ++turn) {
    std::uint64_t bits[kNumRings];
    for (std::size_t i = 0; i < kNumRings; ++i) bits[i] = rings_[i] & query.rings_[i][turn];
    Carried twos[7];
    Carried fours[3];
    for (std::size_t i = 0; i < 5; ++i) {
      twos[i] = AddBits(bits[3 * i], bits[3 * i + 1], bits[3 * i + 2]);
    }
    twos[5] = AddBits(twos[0].sum, twos[1].sum, twos[2].sum);
    twos[6] = AddBits(twos[5].sum, twos[3].sum, twos[4].sum);
    fours[0] = AddBits(twos[0].carry, twos[1].carry, twos[2].carry);
    fours[1] = AddBits(twos[3].carry, twos[4].carry, twos[5].carry);
    fours[2] = AddBits(fours[0].sum, fours[1].sum, twos[6].carry);
    const Carried last = AddBits(fours[0].carry, fours[1].carry, fours[2].carry);
    digits[0][turn] = twos[6].sum;
    digits[1][turn] = fours[2].sum;
    digits[2][turn] = last.sum;
    digits[3][turn] = last.carry;
  }
  Agreement agreement;
  for (std::size_t turn = 0; turn < kNumSectors; ++turn) {
    agreement[turn] = std::popcount(digits[0][turn]) + 2 * std::popcount(digits[1][turn]) +
                      4 * std::popcount(digits[2][turn]) + 8 * std::popcount(digits[3][turn]);
  }
  return agreement;
}

std::vector<double> BearingGrid::BestHeadings(const BearingGrid& query, int max_headings) const {
  return BestHeadings(AgreementByTurn(TurnedBearings(query)), max_headings);
}

std::vector<double> BearingGrid::BestHeadings(Agreement agreement, int max_headings) {
  std::vector<double> headings;
  while (static_cast<int>(headings.size()) < max_headings) {
    const auto best = std::max_element(agreement.begin(), agreement.end());
    if (*best <= 0) break;
    const auto turn = static_cast<int>(best - agreement.begin());
    headings.push_back(WrapAngle(turn * kSector_rad));
    for (int near = turn - 2; near <= turn + 2; ++near) {
      agreement[static_cast<std::size_t>((near + kNumSectors) % kNumSectors)] = -1;
    }
  }
  return headings;
}

TurnedBearings::TurnedBearings(const BearingGrid& query) : num_sectors_(query.num_sectors()) {
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    for (std::size_t turn = 0; turn < rings_[i].size(); ++turn) {
      rings_[i][turn] = std::rotl(query.rings_[i], static_cast<int>(turn));
    }
  }
}

}  // namespace scanloc
