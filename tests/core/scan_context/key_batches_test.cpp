#include "scan_context/key_batches.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

std::vector<float> RandomKeys(std::mt19937_64& random, std::size_t num_keys, std::size_t size,
                              float spread) {
  std::normal_distribution<float> value(100.0F, spread);
  std::vector<float> components(num_keys * size);
  for (float& component : components) component = value(random);
  return components;
}

KeyBatches Filled(const std::vector<float>& components, std::size_t size) {
  KeyBatches batches(components, size);
  std::vector<KeyBatches::Query> quantized;
  for (std::size_t i = 0; i < components.size(); i += size) {
    quantized.push_back(batches.Quantize(components.data() + i));
  }
  for (std::size_t begin = 0; begin < quantized.size(); begin += kNumLanes) {
    std::vector<const std::int16_t*> keys;
    for (std::size_t i = begin; i < std::min(begin + kNumLanes, quantized.size()); ++i) {
      keys.push_back(quantized[i].components.data());
    }
    batches.Append(keys);
  }
  return batches;
}

float SquaredDistance(const float* a, const float* b, std::size_t size) {
  double sum = 0.0;
  for (std::size_t c = 0; c < size; ++c) sum += std::pow(double{a[c]} - double{b[c]}, 2);
  return static_cast<float>(sum);
}

/// So that nothing is passed over that is as near.
std::int32_t LimitFor(const KeyBatches& batches, float squared_distance) {
  const float distance = std::sqrt(squared_distance) * 1.00001F + batches.slack();
  return batches.LimitOf(distance * distance);
}

TEST(KeyBatches, PassesOverNothingNearerThanTheLimitAndLittleElseIn) {
  std::mt19937_64 random(1);
  for (const std::size_t size : {1U, 7U, 8U, 20U, 41U, 720U}) {
    SCOPED_TRACE(size);
    const std::size_t num_keys = 5 * kNumLanes + 3;
    const std::vector<float> components = RandomKeys(random, num_keys, size, 300.0F);
    const KeyBatches batches = Filled(components, size);
    ASSERT_EQ(batches.num_batches(), 6U);
    std::size_t num_near = 0;
    std::size_t num_let_in = 0;
    KeyBatches::Sums sums;
    for (int q = 0; q < 20; ++q) {
      // Some of them far outside the keys.
      const std::vector<float> query = RandomKeys(random, 1, size, q % 4 == 0 ? 3000.0F : 300.0F);
      for (std::size_t i = 0; i < num_keys; ++i) {
        // A limit at the distance of one of the keys: the sharpest test for the others.
        const float limit = SquaredDistance(query.data(), &components[i * size], size);
        for (std::size_t j = 0; j < num_keys; ++j) {
          const bool is_near = SquaredDistance(query.data(), &components[j * size], size) <= limit;
          const std::uint32_t near = batches.NearLanes(
              j / kNumLanes, batches.Quantize(query.data()), LimitFor(batches, limit), sums);
          const bool is_let_in = (near >> (j % kNumLanes) & 1U) != 0;
          ASSERT_TRUE(is_let_in || !is_near) << "query " << q << ", key " << j;
          if (q % 4 == 0) continue;
          num_near += is_near ? 1 : 0;
          num_let_in += is_let_in ? 1 : 0;
        }
      }
    }
    if (size > 1 && size < 100) {
      EXPECT_LT(num_let_in, num_near * 11 / 10);
    }
  }
}

TEST(KeyBatches, HasKernelsThatAnswerAlike) {
  const std::vector<key_batches::NamedKernel> kernels = key_batches::Kernels();
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> component(-3000, 3000);
  std::size_t num_near = 0;
  for (const std::size_t num_pairs : {4U, 12U, 24U}) {
    std::vector<std::int16_t> keys(num_pairs * kNumLanes * 2);
    std::vector<std::int16_t> query(num_pairs * 2);
    for (int round = 0; round < 200; ++round) {
      for (std::int16_t& c : keys) c = static_cast<std::int16_t>(component(random));
      for (std::int16_t& c : query) c = static_cast<std::int16_t>(component(random));
      const auto sum_of_lane = [&](std::size_t lane) {
        std::int32_t sum = 0;
        for (std::size_t i = 0; i < 2 * num_pairs; ++i) {
          const int d = keys[i / 2 * 2 * kNumLanes + 2 * lane + i % 2] - query[i];
          sum += d * d;
        }
        return sum;
      };
      // Exactly at one of the lanes, where an error of one shows.
      const std::int32_t limit = sum_of_lane(static_cast<std::size_t>(round) % kNumLanes);
      std::uint32_t expected = 0;
      for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
        if (sum_of_lane(lane) <= limit) expected |= 1U << lane;
      }
      num_near += static_cast<std::size_t>(std::popcount(expected));
      for (const key_batches::NamedKernel& k : kernels) {
        SCOPED_TRACE(k.name);
        KeyBatches::Sums sums;
        ASSERT_EQ(k.kernel(keys.data(), query.data(), num_pairs, limit, sums.data()), expected);
        for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
          if ((expected >> lane & 1U) == 0) continue;
          ASSERT_EQ(sums[lane], sum_of_lane(lane));
        }
        ASSERT_EQ(k.kernel(keys.data(), query.data(), num_pairs, -1, sums.data()), 0U);
      }
    }
  }
  EXPECT_GT(num_near, 600U);
  EXPECT_LT(num_near, 600U * kNumLanes);
}

TEST(KeyBatches, TellHowFarAKeyIsWithinTheirSlack) {
  std::mt19937_64 random(4);
  const std::vector<float> components = RandomKeys(random, kNumLanes, 20, 300.0F);
  const KeyBatches batches = Filled(components, 20);
  const KeyBatches::Query query = batches.Quantize(components.data());
  KeyBatches::Sums sums;
  ASSERT_EQ(batches.NearLanes(0, query, std::numeric_limits<std::int32_t>::max(), sums), 0xFFFFU);
  for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
    const float told = batches.DistanceOf(sums[lane]);
    const float distance =
        std::sqrt(SquaredDistance(components.data(), &components[lane * 20], 20));
    EXPECT_NEAR(std::sqrt(told), distance, batches.slack());
    const std::uint32_t bit = 1U << lane;
    EXPECT_EQ(batches.NearLanes(0, query, batches.LimitOf(told), sums) & bit, bit);
    if (told == 0.0F) continue;
    EXPECT_EQ(batches.NearLanes(0, query, batches.LimitOf(0.9999F * told), sums) & bit, 0U);
  }
}

TEST(KeyBatches, LetsAllInWithoutALimit) {
  std::mt19937_64 random(2);
  const std::vector<float> components = RandomKeys(random, kNumLanes, 20, 300.0F);
  const KeyBatches batches = Filled(components, 20);
  const std::vector<float> far_away(20, 1.0e9F);
  const float infinity = std::numeric_limits<float>::infinity();
  KeyBatches::Sums sums;
  EXPECT_EQ(
      batches.NearLanes(0, batches.Quantize(far_away.data()), LimitFor(batches, infinity), sums),
      0xFFFFU);
}

TEST(KeyBatches, HoldsKeysThatAreAllEqual) {
  const std::vector<float> components(20 * kNumLanes, 7.0F);
  const KeyBatches batches = Filled(components, 20);
  KeyBatches::Sums sums;
  EXPECT_EQ(
      batches.NearLanes(0, batches.Quantize(components.data()), LimitFor(batches, 0.0F), sums),
      0xFFFFU);
}

}  // namespace
}  // namespace scanloc
