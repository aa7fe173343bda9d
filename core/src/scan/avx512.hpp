#pragma once

#ifdef __x86_64__

#include <immintrin.h>

#include <numbers>

#include "scan/bearing.hpp"

// Sixteen numbers at once, for the processors that are quick at it.

#define SCANLOC_AVX512 \
  __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,avx512vbmi2,avx512vpopcntdq")))
#define SCANLOC_AVX512_INLINE inline __attribute__((always_inline)) SCANLOC_AVX512

namespace scanloc::avx512 {

/// The last of these tells newer processors: what older ones take to look sixteen numbers up at
/// once is more by their makers' tables, and was not measured.
inline bool IsQuick() {
  return __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vbmi2") &&
         __builtin_cpu_supports("avx512vpopcntdq") && __builtin_cpu_supports("avx512bf16");
}

using Floats = __m512;
using Ints = __m512i;

SCANLOC_AVX512_INLINE Floats All(float value) { return _mm512_set1_ps(value); }
SCANLOC_AVX512_INLINE Ints All(int value) { return _mm512_set1_epi32(value); }
SCANLOC_AVX512_INLINE Floats AsFloats(Ints bits) { return _mm512_castsi512_ps(bits); }
SCANLOC_AVX512_INLINE Ints AsInts(Floats bits) { return _mm512_castps_si512(bits); }
SCANLOC_AVX512_INLINE Floats ToFloats(Ints values) { return _mm512_cvtepi32_ps(values); }
SCANLOC_AVX512_INLINE Ints ToInts(Floats values) { return _mm512_cvttps_epi32(values); }

/// As SectorFromRear.
SCANLOC_AVX512_INLINE Ints SectorsFromRear(Floats x, Floats y, int num_sectors) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const Floats along = _mm512_abs_ps(x);
  const Floats across = _mm512_abs_ps(y);
  const Floats greater = _mm512_max_ps(along, across);
  const Floats ratio = _mm512_min_ps(along, across) / _mm512_max_ps(greater, All(1e-30F));
  const Floats square = ratio * ratio;
  Floats arc = All(kArcTangent.back());
  for (std::size_t i = kArcTangent.size() - 1; i-- > 0;) arc = All(kArcTangent[i]) + square * arc;
  arc = ratio * arc;
  const __mmask16 are_steep = _mm512_cmp_ps_mask(across, along, _CMP_GT_OQ);
  const Floats quarter_rad =
      _mm512_mask_add_ps(arc, are_steep, arc, All(kPi / 2.0F) - All(2.0F) * arc);
  const __mmask16 are_behind = _mm512_cmp_ps_mask(x, All(0.0F), _CMP_LT_OQ);
  const Floats half_rad =
      _mm512_mask_add_ps(quarter_rad, are_behind, quarter_rad, All(kPi) - All(2.0F) * quarter_rad);
  const Floats azimuth_rad = _mm512_or_ps(half_rad, _mm512_and_ps(y, All(-0.0F)));
  const Ints sectors =
      ToInts((azimuth_rad * All(0.5F / kPi) + All(0.5F)) * All(static_cast<float>(num_sectors)));
  return _mm512_min_epi32(_mm512_max_epi32(sectors, All(0)), All(num_sectors - 1));
}

}  // namespace scanloc::avx512

#endif
