// GCC's own intrinsics begin with values that they do not need.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include "structural/height_kernels.hpp"

#ifdef __x86_64__

#include "scan/avx512.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "structural/horizon.hpp"

namespace scanloc {
namespace {

using avx512::All;
using avx512::Floats;
using avx512::Ints;
using avx512::ToInts;

constexpr std::size_t kStep = 16;

SCANLOC_AVX512_INLINE Floats Within(Floats values, float last) {
  return _mm512_min_ps(_mm512_max_ps(values, All(0.0F)), All(last));
}

/// Bits for all heights below so many.
SCANLOC_AVX512_INLINE Ints HeightsBelow(Floats num_heights) {
  const Ints num = ToInts(Within(num_heights, static_cast<float>(Post::kNumHeights)));
  return _mm512_sub_epi32(_mm512_sllv_epi32(All(1), num), All(1));
}

}  // namespace

SCANLOC_AVX512 MetCounts CountMetByAvx512(const HeightView& given, const std::uint32_t* cells,
                                          const float* reach_squared_m, const float* x_m,
                                          const float* y_m, const std::uint32_t* heights,
                                          std::size_t num_points) {
  const HeightView view = given;
  Ints num_heights = All(0);
  Ints num_met = All(0);
  for (std::size_t begin = 0; begin < num_points; begin += kStep) {
    const __mmask16 are_given = num_points - begin < kStep ? 0xffU : 0xffffU;
    const Floats given_x = _mm512_maskz_loadu_ps(are_given, x_m + begin);
    const Floats given_y = _mm512_maskz_loadu_ps(are_given, y_m + begin);
    const Floats x = All(view.cosine) * given_x - All(view.sine) * given_y + All(view.x_m);
    const Floats y = All(view.sine) * given_x + All(view.cosine) * given_y + All(view.y_m);
    const Floats ranges_squared = x * x + y * y;
    const Floats range = _mm512_sqrt_ps(ranges_squared) * All(view.cells_per_m);
    const Floats reach_squared = _mm512_i32gather_ps(
        avx512::SectorsFromRear(x, y, Horizon::kNumSectors), reach_squared_m, sizeof(float));
    const __mmask16 are_in_reach =
        _mm512_mask_cmp_ps_mask(are_given, ranges_squared, reach_squared, _CMP_LT_OQ);
    const Ints below_highest =
        HeightsBelow(All(view.sensor_height) + range * All(view.highest_slope));
    const Ints below_lowest =
        HeightsBelow(All(view.sensor_height) + range * All(view.lowest_slope) + All(0.999F));
    const Ints here = _mm512_and_epi32(_mm512_andnot_epi32(below_lowest, below_highest),
                                       _mm512_maskz_loadu_epi32(are_in_reach, heights + begin));
    const Ints columns = ToInts(Within(x * All(view.cells_per_m) + All(view.middle), view.last));
    Ints rows = ToInts(Within(y * All(view.cells_per_m) + All(view.middle), view.last));
    rows = _mm512_min_epi32(_mm512_max_epi32(rows, All(1)), All(view.side - 2));
    const Ints at = _mm512_add_epi32(_mm512_mullo_epi32(rows, All(view.side)), columns);
    const Ints there = _mm512_or_epi32(
        _mm512_or_epi32(_mm512_i32gather_epi32(at, cells - view.side, sizeof(*cells)),
                        _mm512_i32gather_epi32(at, cells, sizeof(*cells))),
        _mm512_i32gather_epi32(at, cells + view.side, sizeof(*cells)));
    num_heights = _mm512_add_epi32(num_heights, _mm512_popcnt_epi32(here));
    num_met = _mm512_add_epi32(num_met, _mm512_popcnt_epi32(_mm512_and_epi32(here, there)));
  }
  return {.num_heights = _mm512_reduce_add_epi32(num_heights),
          .num_met = _mm512_reduce_add_epi32(num_met)};
}

}  // namespace scanloc

#endif
