#include "scan_context/key_batches.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace scanloc {
namespace key_batches {
namespace {

/// After so many pairs of components a look at whether any lane can still be near.
constexpr std::size_t kPairsPerLook = 4;

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;
constexpr std::size_t kPairSize = 2 * kNumLanes;

std::uint32_t NearPortable(const std::int16_t* pair, const std::int16_t* of_query,
                           std::size_t num_pairs, std::int32_t limit, std::int32_t* sums) {
  std::fill_n(sums, kNumLanes, 0);
  for (std::size_t p = 0; p < num_pairs; ++p, pair += kPairSize, of_query += 2) {
    for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
      const std::int32_t a = pair[2 * lane] - of_query[0];
      const std::int32_t b = pair[2 * lane + 1] - of_query[1];
      sums[lane] += a * a + b * b;
    }
  }
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
    if (sums[lane] <= limit) near |= 1U << lane;
  }
  return near;
}

#ifdef __x86_64__

std::int32_t PairOf(const std::int16_t* components) {
  std::int32_t pair = 0;
  std::memcpy(&pair, components, sizeof(pair));
  return pair;
}

std::uint32_t NearSse2(const std::int16_t* pair, const std::int16_t* of_query,
                       std::size_t num_pairs, std::int32_t limit, std::int32_t* sums) {
  constexpr std::size_t kNumRegisters = kNumLanes / 4;
  const __m128i limits = _mm_set1_epi32(limit);
  __m128i parts[kNumRegisters] = {};
  std::uint32_t far = 0;
  for (std::size_t p = 0; p < num_pairs; p += kPairsPerLook) {
    for (std::size_t i = 0; i < kPairsPerLook; ++i, pair += kPairSize, of_query += 2) {
      const __m128i both = _mm_set1_epi32(PairOf(of_query));
      for (std::size_t r = 0; r < kNumRegisters; ++r) {
        const __m128i keys = _mm_loadu_si128(reinterpret_cast<const __m128i*>(pair) + r);
        const __m128i differences = _mm_sub_epi16(keys, both);
        parts[r] = _mm_add_epi32(parts[r], _mm_madd_epi16(differences, differences));
      }
    }
    far = 0;
    for (std::size_t r = 0; r < kNumRegisters; ++r) {
      const __m128 is_far = _mm_castsi128_ps(_mm_cmpgt_epi32(parts[r], limits));
      far |= static_cast<std::uint32_t>(_mm_movemask_ps(is_far)) << (4 * r);
    }
    if (far == 0xFFFFU) return 0;
  }
  for (std::size_t r = 0; r < kNumRegisters; ++r) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(sums) + r, parts[r]);
  }
  return ~far & 0xFFFFU;
}

__attribute__((target("avx2"))) std::uint32_t NearAvx2(const std::int16_t* pair,
                                                       const std::int16_t* of_query,
                                                       std::size_t num_pairs, std::int32_t limit,
                                                       std::int32_t* sums) {
  const __m256i limits = _mm256_set1_epi32(limit);
  __m256i low = _mm256_setzero_si256();
  __m256i high = _mm256_setzero_si256();
  std::uint32_t far = 0;
  for (std::size_t p = 0; p < num_pairs; p += kPairsPerLook) {
    for (std::size_t i = 0; i < kPairsPerLook; ++i, pair += kPairSize, of_query += 2) {
      const __m256i both = _mm256_set1_epi32(PairOf(of_query));
      const auto* keys = reinterpret_cast<const __m256i*>(pair);
      const __m256i of_low = _mm256_sub_epi16(_mm256_loadu_si256(keys), both);
      const __m256i of_high = _mm256_sub_epi16(_mm256_loadu_si256(keys + 1), both);
      low = _mm256_add_epi32(low, _mm256_madd_epi16(of_low, of_low));
      high = _mm256_add_epi32(high, _mm256_madd_epi16(of_high, of_high));
    }
    const __m256 is_low_far = _mm256_castsi256_ps(_mm256_cmpgt_epi32(low, limits));
    const __m256 is_high_far = _mm256_castsi256_ps(_mm256_cmpgt_epi32(high, limits));
    far = static_cast<std::uint32_t>(_mm256_movemask_ps(is_low_far)) |
          (static_cast<std::uint32_t>(_mm256_movemask_ps(is_high_far)) << 8);
    if (far == 0xFFFFU) return 0;
  }
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums), low);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums) + 1, high);
  return ~far & 0xFFFFU;
}

#endif

}  // namespace

std::vector<NamedKernel> Kernels() {
  std::vector<NamedKernel> kernels;
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) kernels.push_back({"avx2", &NearAvx2});
  kernels.push_back({"sse2", &NearSse2});
#endif
  kernels.push_back({"portable", &NearPortable});
  return kernels;
}

}  // namespace key_batches

using key_batches::kPairSize;
using key_batches::kPairsPerLook;

KeyBatches::KeyBatches(std::span<const float> sample, std::size_t size)
    : size_(size),
      num_pairs_((size + 2 * kPairsPerLook - 1) / (2 * kPairsPerLook) * kPairsPerLook),
      batch_size_(num_pairs_ * kPairSize),
      // The squares of differences of at most twice this, all added, fit into 32 bits.
      max_(static_cast<std::int32_t>(
          std::sqrt(static_cast<double>(std::numeric_limits<std::int32_t>::max()) /
                    (8.0 * static_cast<double>(num_pairs_))))),
      centers_(size) {
  float half_range = 0.0F;
  for (std::size_t c = 0; c < size; ++c) {
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    for (std::size_t i = c; i < sample.size(); i += size) {
      low = std::min(low, sample[i]);
      high = std::max(high, sample[i]);
    }
    if (low > high) continue;
    centers_[c] = 0.5F * (low + high);
    half_range = std::max(half_range, 0.5F * (high - low));
  }
  if (half_range > 0.0F) scale_ = static_cast<float>(max_) / half_range;
}

std::int16_t KeyBatches::Quantized(float value, std::size_t component) const {
  const auto bound = static_cast<float>(max_);
  const float scaled = std::clamp((value - centers_[component]) * scale_, -bound, bound);
  return static_cast<std::int16_t>(scaled + std::copysign(0.5F, scaled));
}

void KeyBatches::Append(std::span<const std::int16_t* const> keys) {
  const std::size_t begin = components_.size();
  components_.resize(begin + batch_size_);
  for (std::size_t lane = 0; lane < keys.size(); ++lane) {
    for (std::size_t c = 0; c < size_; ++c) {
      components_[begin + c / 2 * kPairSize + 2 * lane + c % 2] = keys[lane][c];
    }
  }
}

KeyBatches::Query KeyBatches::Quantize(const float* key) const {
  Query query{std::vector<std::int16_t>(key_size())};
  Quantize(key, query.components);
  return query;
}

void KeyBatches::Quantize(const float* key, std::span<std::int16_t> components) const {
  for (std::size_t c = 0; c < size_; ++c) components[c] = Quantized(key[c], c);
}

std::int32_t KeyBatches::LimitOf(float squared_distance) const {
  // A little more, for the arithmetic of DistanceOf.
  const double sum = 1.000001 * double{squared_distance} * double{scale_} * double{scale_} + 1.0;
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::min(sum, kMost));
}

std::uint32_t KeyBatches::NearLanes(std::size_t batch, const Query& query, std::int32_t limit,
                                    Sums& sums) const {
  static const key_batches::Kernel kKernel = key_batches::Kernels().front().kernel;
  return kKernel(components_.data() + batch * batch_size_, query.components.data(), num_pairs_,
                 limit, sums.data());
}

}  // namespace scanloc
