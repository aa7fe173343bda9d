#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace scanloc {

/// How another scan's points lie in a grid of heights, and what its sensor could see.
struct HeightView {
  int side;
  float cosine, sine, x_m, y_m, cells_per_m, middle, last;
  // In cells above the lowest height.
  float sensor_height, lowest_slope, highest_slope;
};

/// Of the heights at which points have something, those that could be seen, and those met.
struct MetCounts {
  int num_heights = 0;
  int num_met = 0;
};

/// Of points, whole blocks of PlanarPoints.
using HeightKernel = MetCounts (*)(const HeightView& view, const std::uint32_t* cells,
                                   const float* reach_squared_m, const float* x_m, const float* y_m,
                                   const std::uint32_t* heights, std::size_t num_points);

/// All that this processor has, the fastest first; all give the same counts.
[[nodiscard]] std::vector<HeightKernel> HeightKernels();

#ifdef __x86_64__
MetCounts CountMetByAvx512(const HeightView& view, const std::uint32_t* cells,
                           const float* reach_squared_m, const float* x_m, const float* y_m,
                           const std::uint32_t* heights, std::size_t num_points);
#endif

}  // namespace scanloc
