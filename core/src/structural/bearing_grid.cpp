#include "structural/bearing_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "scan/simd.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "structural/bearing.hpp"

namespace scanloc {
namespace {

constexpr double kSector_rad = 2.0 * std::numbers::pi / BearingGrid::kNumSectors;

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
  BearingGrid wide;
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    wide.rings_[i] = rings_[i] | std::rotl(rings_[i], 1) | std::rotr(rings_[i], 1);
  }
  return wide;
}

SCANLOC_SIMD BearingGrid::Agreement BearingGrid::AgreementByTurn(const BearingGrid& query) const {
  Agreement agreement{};
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    if (rings_[i] == 0 || query.rings_[i] == 0) continue;
    for (int turn = 0; turn < kNumSectors; ++turn) {
      agreement[static_cast<std::size_t>(turn)] +=
          std::popcount(rings_[i] & std::rotl(query.rings_[i], turn));
    }
  }
  return agreement;
}

std::vector<double> BearingGrid::BestHeadings(const BearingGrid& query, int max_headings) const {
  Agreement agreement = AgreementByTurn(query);
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

}  // namespace scanloc
