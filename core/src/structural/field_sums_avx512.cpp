// GCC's own intrinsics begin with values that they do not need.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include "structural/field_sums.hpp"

#ifdef __x86_64__

#include <bit>

#include "scan/avx512.hpp"
#include "structural/horizon.hpp"

namespace scanloc::field_sums {
namespace {

using avx512::All;
using avx512::AsFloats;
using avx512::Floats;
using avx512::Ints;
using avx512::SectorsFromRear;
using avx512::ToFloats;
using avx512::ToInts;

constexpr std::size_t kBlock = PlanarPoints::kBlock;
constexpr std::size_t kStep = 2 * kBlock;

/// Two blocks of points, turned as a field's pose says, or a last one.
struct Points {
  SCANLOC_AVX512_INLINE Points(const Placed& field, const float* x_m, const float* y_m,
                               std::size_t num_left)
      : are_given(num_left < kStep ? 0xffU : 0xffffU) {
    const Floats x = _mm512_maskz_loadu_ps(are_given, x_m);
    const Floats y = _mm512_maskz_loadu_ps(are_given, y_m);
    turned_u = All(field.cosine) * x - All(field.sine) * y;
    turned_v = All(field.sine) * x + All(field.cosine) * y;
  }

  __mmask16 are_given;
  Floats turned_u, turned_v;
};

/// The four cells around each point and how far it lies between them, as FieldSample.
struct Samples {
  SCANLOC_AVX512_INLINE Samples(const Placed& field, const Points& points) {
    const Floats u = Within(points.turned_u + All(field.origin_u), field.last);
    const Floats v = Within(points.turned_v + All(field.origin_v), field.last);
    const Ints columns = ToInts(u);
    const Ints rows = ToInts(v);
    between_columns = u - ToFloats(columns);
    between_rows = v - ToFloats(rows);
    const Ints cells = _mm512_add_epi32(_mm512_mullo_epi32(rows, All(field.side)), columns);
    FindRow(_mm512_i32gather_epi32(cells, field.cells, 2), low, low_step);
    FindRow(_mm512_i32gather_epi32(cells, field.cells + field.side, 2), high, high_step);
  }
  SCANLOC_AVX512_INLINE Floats along_row(Floats start, Floats step) const {
    return start + step * between_columns;
  }
  SCANLOC_AVX512_INLINE Floats slope_v() const {
    return along_row(high, high_step) - along_row(low, low_step);
  }
  SCANLOC_AVX512_INLINE Floats slope_u() const {
    return low_step * (All(1.0F) - between_rows) + high_step * between_rows;
  }
  SCANLOC_AVX512_INLINE Floats distance() const {
    return along_row(low, low_step) + slope_v() * between_rows;
  }

  Floats between_columns, between_rows, low, low_step, high, high_step;

 private:
  static SCANLOC_AVX512_INLINE Floats Within(Floats values, float last) {
    return _mm512_min_ps(_mm512_max_ps(values, All(0.0F)), All(last));
  }
  /// Of pairs of neighbours the first and by how much the second is more, both exactly: a number of
  /// 16 bits is the fraction of a float that begins at 2²³.
  static SCANLOC_AVX512_INLINE void FindRow(Ints pairs, Floats& first, Floats& step) {
    constexpr float kBegin = 8388608.0F;
    constexpr int kBeginBits = std::bit_cast<int>(kBegin);
    constexpr int kMaskThenOr = 0xEA;
    const Floats from_begin =
        AsFloats(_mm512_ternarylogic_epi32(pairs, All(0xffff), All(kBeginBits), kMaskThenOr));
    const Floats second_from_begin = AsFloats(_mm512_shrdi_epi32(pairs, All(kBeginBits >> 16), 16));
    first = from_begin - All(kBegin);
    step = second_from_begin - from_begin;
  }
};

/// Adds the first block of a, then the second; of b the same, in the other half of the sums.
SCANLOC_AVX512_INLINE Floats AddBlocks(Floats sums, Floats a, Floats b) {
  constexpr int kSecondBlocks = 0xEE;
  sums = sums + _mm512_insertf32x8(a, _mm512_castps512_ps256(b), 1);
  return sums + _mm512_shuffle_f32x4(a, b, kSecondBlocks);
}

SCANLOC_AVX512_INLINE __m256 AddBlocks(__m256 sums, Floats values) {
  return (sums + _mm512_castps512_ps256(values)) + _mm512_extractf32x8_ps(values, 1);
}

SCANLOC_AVX512_INLINE float SumOf(const float* lanes) {
  float sum = 0.0F;
  for (std::size_t lane = 0; lane < kBlock; ++lane) sum += lanes[lane];
  return sum;
}

SCANLOC_AVX512_INLINE float SumOf(__m256 lanes) {
  alignas(32) float stored[kBlock];
  _mm256_store_ps(stored, lanes);
  return SumOf(stored);
}

SCANLOC_AVX512 void AddUp(const Placed& placed, float width_m, const float* x_m, const float* y_m,
                          std::size_t num_points, Sums& sums) {
  const Placed field = placed;
  const Floats inverse_width = All(1.0F / width_m);
  const Floats slope_unit = All(field.unit_m * field.cells_per_m);
  Floats pairs[kNumSums / 2] = {};
  __m256 last = {};
  for (std::size_t begin = 0; begin < num_points; begin += kStep) {
    const Points points(field, x_m + begin, y_m + begin, num_points - begin);
    const Samples samples(field, points);
    const Floats distance = samples.distance() * All(field.unit_m);
    const Floats gradient_x = samples.slope_u() * slope_unit;
    const Floats gradient_y = samples.slope_v() * slope_unit;
    const Floats gradient_yaw =
        (gradient_y * points.turned_u - gradient_x * points.turned_v) * All(field.cell_m);
    const Floats scaled = distance * inverse_width;
    const Floats root = All(1.0F) / (All(1.0F) + scaled * scaled);
    const Floats weight = _mm512_maskz_mul_ps(points.are_given, root, root);
    const Floats weighted_x = weight * gradient_x;
    const Floats weighted_y = weight * gradient_y;
    const Floats weighted_yaw = weight * gradient_yaw;
    pairs[0] = AddBlocks(pairs[0], weighted_x * gradient_x, weighted_x * gradient_y);
    pairs[1] = AddBlocks(pairs[1], weighted_x * gradient_yaw, weighted_y * gradient_y);
    pairs[2] = AddBlocks(pairs[2], weighted_y * gradient_yaw, weighted_yaw * gradient_yaw);
    pairs[3] = AddBlocks(pairs[3], weighted_x * distance, weighted_y * distance);
    last = AddBlocks(last, weighted_yaw * distance);
  }
  alignas(64) float lanes[kNumSums * kBlock];
  for (std::size_t i = 0; i < kNumSums / 2; ++i) _mm512_store_ps(lanes + i * kStep, pairs[i]);
  _mm256_store_ps(lanes + (kNumSums - 1) * kBlock, last);
  for (std::size_t i = 0; i < kNumSums; ++i) sums[i] = SumOf(lanes + i * kBlock);
}

/// exp(-precision · distance²) of the points for which it is asked, else 0.
SCANLOC_AVX512_INLINE Floats OverlapAt(const Placed& field, const Points& points, Floats precision,
                                       __mmask16 are_asked) {
  const Floats distance = Samples(field, points).distance();
  const Floats octaves = precision * distance * distance * All(kOctaves);
  const Ints whole = _mm512_sub_epi32(ToInts(octaves), All(1));
  const Floats rest = octaves - ToFloats(whole);
  Floats power = All(kPowerOfTwo.back());
  for (std::size_t i = kPowerOfTwo.size() - 1; i-- > 0;) power = All(kPowerOfTwo[i]) + rest * power;
  const Ints exponent = _mm512_slli_epi32(_mm512_add_epi32(whole, All(127)), 23);
  return _mm512_maskz_mul_ps(are_asked, power, AsFloats(exponent));
}

SCANLOC_AVX512 float SumOverlap(const Placed& placed, float precision, const float* x_m,
                                const float* y_m, std::size_t num_points) {
  const Placed field = placed;
  __m256 sums = {};
  for (std::size_t begin = 0; begin < num_points; begin += kStep) {
    const Points points(field, x_m + begin, y_m + begin, num_points - begin);
    sums = AddBlocks(sums, OverlapAt(field, points, All(precision), points.are_given));
  }
  return SumOf(sums);
}

SCANLOC_AVX512 InSight SumOverlapWithin(const Placed& placed, const float* reach_squared_m,
                                        float precision, const float* x_m, const float* y_m,
                                        std::size_t num_points) {
  const Placed field = placed;
  const float middle = static_cast<float>(field.side) / 2.0F - 0.5F;
  const Floats from_middle_u = All(field.origin_u - middle);
  const Floats from_middle_v = All(field.origin_v - middle);
  const Floats cell_squared_m = All(field.cell_m * field.cell_m);
  __m256 sums = {};
  InSight sum;
  for (std::size_t begin = 0; begin < num_points; begin += kStep) {
    const Points points(field, x_m + begin, y_m + begin, num_points - begin);
    const Floats u = points.turned_u + from_middle_u;
    const Floats v = points.turned_v + from_middle_v;
    const Floats reach_squared = _mm512_i32gather_ps(SectorsFromRear(u, v, Horizon::kNumSectors),
                                                     reach_squared_m, sizeof(float));
    const __mmask16 are_seen = _mm512_mask_cmp_ps_mask(
        points.are_given, (u * u + v * v) * cell_squared_m, reach_squared, _CMP_LT_OQ);
    sums = AddBlocks(sums, OverlapAt(field, points, All(precision), are_seen));
    sum.num_points += std::popcount(static_cast<unsigned>(are_seen));
  }
  sum.overlap = SumOf(sums);
  return sum;
}

}  // namespace

const Kernels kAvx512 = {"avx512", &AddUp, &SumOverlap, &SumOverlapWithin};

}  // namespace scanloc::field_sums

#endif
