#include "key_batches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace scanloc {
namespace {

/// After so many pairs of components a look at whether any lane can still be near.
constexpr std::size_t kPairsPerLook = 4;

constexpr std::size_t kPairSize = 2 * KeyBatches::kNumLanes;

}  // namespace

KeyBatches::KeyBatches(std::span<const float> components, std::size_t size)
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
    for (std::size_t i = c; i < components.size(); i += size) {
      low = std::min(low, components[i]);
      high = std::max(high, components[i]);
    }
    if (low > high) continue;
    centers_[c] = 0.5F * (low + high);
    half_range = std::max(half_range, 0.5F * (high - low));
  }
  if (half_range > 0.0F) scale_ = static_cast<float>(max_) / half_range;
}

std::int16_t KeyBatches::Quantized(float value, std::size_t component) const {
  // What lies outside is moved to the bound, which brings it nearer to all keys within.
  const auto bound = static_cast<float>(max_);
  const float scaled = std::clamp((value - centers_[component]) * scale_, -bound, bound);
  return static_cast<std::int16_t>(std::lround(scaled));
}

void KeyBatches::Append(std::span<const float* const> keys) {
  const std::size_t begin = components_.size();
  components_.resize(begin + batch_size_);
  for (std::size_t lane = 0; lane < keys.size(); ++lane) {
    for (std::size_t c = 0; c < size_; ++c) {
      components_[begin + c / 2 * kPairSize + 2 * lane + c % 2] = Quantized(keys[lane][c], c);
    }
  }
}

KeyBatches::Query KeyBatches::Quantize(const float* key) const {
  Query query{std::vector<std::int16_t>(2 * num_pairs_)};
  for (std::size_t c = 0; c < size_; ++c) query.components[c] = Quantized(key[c], c);
  return query;
}

std::int32_t KeyBatches::LimitOf(float squared_distance) const {
  // Rounding moves either key by up to half a step a component; the difference is one step, and a
  // little for the arithmetic.
  const double rounding = 1.01 * std::sqrt(static_cast<double>(size_));
  const double distance = std::sqrt(double{squared_distance}) * scale_ * 1.00001 + rounding;
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::min(distance * distance, kMost));
}

#ifdef __SSE2__

std::uint32_t KeyBatches::NearLanes(std::size_t batch, const Query& query,
                                    std::int32_t limit) const {
  constexpr std::size_t kNumRegisters = kNumLanes / 4;
  const std::int16_t* pair = components_.data() + batch * batch_size_;
  const std::int16_t* of_query = query.components.data();
  const __m128i limits = _mm_set1_epi32(limit);
  __m128i sums[kNumRegisters] = {};
  __m128i far[kNumRegisters] = {};
  for (std::size_t p = 0; p < num_pairs_; p += kPairsPerLook) {
    for (std::size_t i = 0; i < kPairsPerLook; ++i) {
      const __m128i both = _mm_set1_epi32(static_cast<std::int32_t>(
          static_cast<std::uint16_t>(of_query[0]) |
          (static_cast<std::uint32_t>(static_cast<std::uint16_t>(of_query[1])) << 16)));
      for (std::size_t r = 0; r < kNumRegisters; ++r) {
        const __m128i keys = _mm_loadu_si128(reinterpret_cast<const __m128i*>(pair) + r);
        const __m128i differences = _mm_sub_epi16(keys, both);
        sums[r] = _mm_add_epi32(sums[r], _mm_madd_epi16(differences, differences));
      }
      pair += kPairSize;
      of_query += 2;
    }
    for (std::size_t r = 0; r < kNumRegisters; ++r) far[r] = _mm_cmpgt_epi32(sums[r], limits);
    const __m128i all = _mm_and_si128(_mm_and_si128(far[0], far[1]), _mm_and_si128(far[2], far[3]));
    if (_mm_movemask_epi8(all) == 0xFFFF) return 0;
  }
  const __m128i far_lanes =
      _mm_packs_epi16(_mm_packs_epi32(far[0], far[1]), _mm_packs_epi32(far[2], far[3]));
  return ~static_cast<std::uint32_t>(_mm_movemask_epi8(far_lanes)) & 0xFFFFU;
}

#else

std::uint32_t KeyBatches::NearLanes(std::size_t batch, const Query& query,
                                    std::int32_t limit) const {
  const std::int16_t* pair = components_.data() + batch * batch_size_;
  std::int32_t sums[kNumLanes] = {};
  for (std::size_t p = 0; p < num_pairs_; ++p, pair += kPairSize) {
    for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
      const std::int32_t a = pair[2 * lane] - query.components[2 * p];
      const std::int32_t b = pair[2 * lane + 1] - query.components[2 * p + 1];
      sums[lane] += a * a + b * b;
    }
  }
  std::uint32_t near = 0;
  for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
    if (sums[lane] <= limit) near |= 1U << lane;
  }
  return near;
}

#endif

}  // namespace scanloc
