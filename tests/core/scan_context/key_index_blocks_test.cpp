// An index over several blocks of keys, some of them another table's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {
namespace {

/// Keys that change little by little, some hundred thousand of them, as of a drive.
std::vector<std::vector<std::int32_t>> KeysOfADrive(std::size_t num_keys) {
  std::mt19937_64 random(17);
  std::vector<std::int32_t> key = std::vector<std::int32_t>(8, 2500);
  std::vector<std::vector<std::int32_t>> keys;
  for (std::size_t i = 0; i < num_keys; ++i) {
    for (std::int32_t& sum_cm : key) {
      sum_cm += static_cast<std::int32_t>(random() % 401) - 200;
      sum_cm = std::clamp<std::int32_t>(sum_cm, 0, 5000);
    }
    keys.push_back(key);
  }
  return keys;
}

ContextTable TableOf(const std::vector<std::vector<std::int32_t>>& keys, bool with_flips) {
  ContextTable table(static_cast<int>(keys.front().size()), 2);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    table.AppendKey({.place = static_cast<std::int32_t>(i)}, keys[i]);
    if (with_flips) table.AppendFlipOfLast();
  }
  return table;
}

void ExpectSameNeighbors(const KeyIndex& a, const KeyIndex& b,
                         const std::vector<std::int32_t>& query) {
  const auto found = a.Search(query, 50, true);
  const auto expected = b.Search(query, 50, true);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t n = 0; n < found.size(); ++n) {
    EXPECT_EQ(found[n].entry, expected[n].entry);
    EXPECT_EQ(found[n].key_distance, expected[n].key_distance);
  }
}

TEST(KeyIndex, TakesTreesOfSharedBlocksAndAnswersAsOneMadeAnew) {
  std::vector<std::vector<std::int32_t>> keys = KeysOfADrive(450'000);
  for (const bool with_flips : {false, true}) {
    SCOPED_TRACE(with_flips);
    const ContextTable table = TableOf(keys, with_flips);
    ASSERT_GE(table.key_blocks().full().size(), 3U);
    const KeyIndex before(table);
    // One left out of the second block, and some more at the end.
    auto other = keys;
    other.erase(other.begin() + static_cast<std::ptrdiff_t>(table.key_blocks().ends()[0]) + 100);
    other.insert(other.end(), keys.begin(), keys.begin() + 3000);
    ContextTable next = TableOf(other, with_flips);
    const KeyIndex anew(next);
    next.ShareKeysWith(table);
    const KeyIndex after(next, &before);
    EXPECT_EQ(after.TreeOf(next, 0), before.TreeOf(table, 0));
    EXPECT_EQ(after.TreeOf(next, 2), before.TreeOf(table, 2));
    EXPECT_NE(after.TreeOf(next, 1), nullptr);
    EXPECT_NE(after.TreeOf(next, 1), before.TreeOf(table, 1));
    EXPECT_EQ(before.TreeOf(next, 1), nullptr) << "the block with the change is another one";
    for (std::size_t q = 0; q < 40; ++q) {
      const std::vector<std::int32_t> query = keys[q * keys.size() / 40];
      ExpectSameNeighbors(after, anew, query);
    }
  }
}

TEST(KeyIndex, FindsInSeveralTreesAllThatIsNearest) {
  const std::vector<std::vector<std::int32_t>> keys = KeysOfADrive(300'000);
  const ContextTable table = TableOf(keys, false);
  ASSERT_GE(table.key_blocks().full().size(), 2U);
  const KeyIndex index(table);
  for (std::size_t q = 0; q < 5; ++q) {
    const std::vector<std::int32_t>& query = keys[q * keys.size() / 5];
    std::vector<double> by_hand;
    for (const std::vector<std::int32_t>& key : keys) {
      double sum = 0.0;
      for (std::size_t r = 0; r < key.size(); ++r) sum += std::pow(0.01 * (key[r] - query[r]), 2);
      by_hand.push_back(std::sqrt(sum));
    }
    std::sort(by_hand.begin(), by_hand.end());
    const auto found = index.Search(query, 20, true);
    ASSERT_EQ(found.size(), 20U);
    for (std::size_t n = 0; n < found.size(); ++n) {
      EXPECT_NEAR(found[n].key_distance, by_hand[n], 1e-4);
    }
  }
}

TEST(KeyIndex, GrowsFromBlockToBlock) {
  const std::vector<std::vector<std::int32_t>> keys = KeysOfADrive(300'000);
  ContextTable table(8, 2);
  KeyIndex grown(table);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    table.AppendKey({.place = static_cast<std::int32_t>(i)}, keys[i]);
    table.AppendFlipOfLast();
    if (i % 5000 == 0) grown.Extend();
  }
  grown.Extend();
  ASSERT_GE(table.key_blocks().full().size(), 2U);
  const KeyIndex at_once(table);
  for (std::size_t q = 0; q < 20; ++q) {
    ExpectSameNeighbors(grown, at_once, keys[q * keys.size() / 20]);
  }
}

}  // namespace
}  // namespace scanloc
