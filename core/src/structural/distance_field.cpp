#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "scan/simd.hpp"
#include "scanloc/core/structural/registration.hpp"

namespace scanloc {
namespace {

/// Points that fill up a block: out of reach of every field, so that they add nothing.
constexpr float kFarPoint_m = 1.0e6F;

using StampBlock = std::uint16_t __attribute__((vector_size(2 * DistanceField::kStampBlock)));

}  // namespace

void PlanarPoints::Assign(std::span<const Post> posts, std::size_t max_points) {
  size_ = std::min(posts.size(), max_points);
  const std::size_t num_padded = (size_ + kBlock - 1) / kBlock * kBlock;
  x_m_.resize(num_padded);
  y_m_.resize(num_padded);
  heights_.resize(num_padded);
  std::fill(x_m_.begin() + static_cast<std::ptrdiff_t>(size_), x_m_.end(), kFarPoint_m);
  std::fill(y_m_.begin() + static_cast<std::ptrdiff_t>(size_), y_m_.end(), kFarPoint_m);
  std::fill(heights_.begin() + static_cast<std::ptrdiff_t>(size_), heights_.end(), 0U);
  // As locals: what is written could be the vectors' own for all the compiler knows.
  float* const x_m = x_m_.data();
  float* const y_m = y_m_.data();
  std::uint32_t* const heights = heights_.data();
  const auto take = [=](std::size_t i, const Post& post) {
    x_m[i] = static_cast<float>(post.x_cm) * 0.01F;
    y_m[i] = static_cast<float>(post.y_cm) * 0.01F;
    heights[i] = post.heights;
  };
  if (size_ == posts.size()) {
    for (std::size_t i = 0; i < size_; ++i) take(i, posts[i]);
    return;
  }
  if (size_ == 0) return;
  // The i-th is post i · posts / points, without a division for each.
  const std::size_t stride = posts.size() / size_;
  const std::size_t rest = posts.size() % size_;
  std::size_t post = 0;
  std::size_t gathered = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    take(i, posts[post]);
    post += stride;
    gathered += rest;
    if (gathered >= size_) {
      gathered -= size_;
      ++post;
    }
  }
}

DistanceField::DistanceField(double cell_m, double reach_m, double cutoff_m)
    : cell_m_(static_cast<float>(cell_m)),
      unit_m_(static_cast<float>(cutoff_m) / kCutoff),
      reach_m_(static_cast<float>(reach_m)),
      side_(static_cast<int>(2.0 * (reach_m + cutoff_m) / cell_m) + 4),
      radius_(static_cast<int>(cutoff_m / cell_m)),
      stamp_row_(static_cast<std::size_t>(2 * radius_ + 1 + kStampBlock - 1) / kStampBlock *
                 kStampBlock),
      stamps_(static_cast<std::size_t>(kPhases * kPhases * (2 * radius_ + 1)) * stamp_row_),
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) + stamp_row_) {
  MakeStamps();
}

SCANLOC_SIMD void DistanceField::MakeStamps() {
  const float units_per_cell = cell_m_ / unit_m_;
  const auto from_centre = [&](int cell, int phase) {
    return (static_cast<float>(cell - radius_) + 0.5F -
            (static_cast<float>(phase) + 0.5F) / kPhases) *
           units_per_cell;
  };
  std::uint16_t* __restrict stamp = stamps_.data();
  for (int phase_v = 0; phase_v < kPhases; ++phase_v) {
    for (int phase_u = 0; phase_u < kPhases; ++phase_u) {
      for (int row = 0; row <= 2 * radius_; ++row, stamp += stamp_row_) {
        const float dy = from_centre(row, phase_v);
        for (std::size_t column = 0; column < stamp_row_; ++column) {
          const float dx = from_centre(static_cast<int>(column), phase_u);
          const float distance = __builtin_sqrtf(dx * dx + dy * dy) + 0.5F;
          stamp[column] = static_cast<std::uint16_t>(
              static_cast<std::int32_t>(distance < kCutoff ? distance : kCutoff));
        }
      }
    }
  }
}

SCANLOC_SIMD void DistanceField::Fill(const PlanarPoints& posts) {
  static_assert(kCutoff == 0xffffU);
  std::memset(cells_.data(), 0xff, sizeof(cells_[0]) * cells_.size());
  // As locals: the cells written could be any of the members for all the compiler knows.
  const int side = side_;
  const int radius = radius_;
  const std::size_t stamp_row = stamp_row_;
  const std::size_t stamp_size = static_cast<std::size_t>(2 * radius + 1) * stamp_row;
  const std::uint16_t* const stamps = stamps_.data();
  std::uint16_t* const cells = cells_.data();
  const float reach_m = reach_m_;
  const float cells_per_m = 1.0F / cell_m_;
  const float centre = static_cast<float>(side) / 2.0F;
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const float x_m = posts.x_m()[i];
    const float y_m = posts.y_m()[i];
    if (std::abs(x_m) > reach_m || std::abs(y_m) > reach_m) continue;
    const float u = x_m * cells_per_m + centre;
    const float v = y_m * cells_per_m + centre;
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    const int phase_u = static_cast<int>((u - static_cast<float>(column)) * kPhases);
    const int phase_v = static_cast<int>((v - static_cast<float>(row)) * kPhases);
    const std::uint16_t* stamp =
        stamps + static_cast<std::size_t>(phase_v * kPhases + phase_u) * stamp_size;
    std::uint16_t* corner =
        cells + static_cast<std::ptrdiff_t>(row - radius) * side + (column - radius);
    // What of a block lies beyond the stamp, or in the next row, is at the cut-off.
    for (std::size_t begin = 0; begin < stamp_row; begin += kStampBlock) {
      for (int r = 0; r <= 2 * radius; ++r) {
        StampBlock nearer;
        StampBlock known;
        std::uint16_t* const block = corner + std::ptrdiff_t{r} * side + begin;
        std::memcpy(&nearer, stamp + static_cast<std::size_t>(r) * stamp_row + begin,
                    sizeof(nearer));
        std::memcpy(&known, block, sizeof(known));
        known = nearer < known ? nearer : known;
        std::memcpy(block, &known, sizeof(known));
      }
    }
  }
}

}  // namespace scanloc
