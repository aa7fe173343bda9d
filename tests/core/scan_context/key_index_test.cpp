#include "scanloc/core/scan_context/key_index.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

namespace scanloc {
namespace {

constexpr int kNumRows = 5;

std::vector<std::int32_t> RandomKey(std::mt19937_64& random, int spread, int num_rows = kNumRows) {
  std::vector<std::int32_t> key;
  for (int r = 0; r < num_rows; ++r) key.push_back(static_cast<std::int32_t>(random() % spread));
  return key;
}

void Append(ContextTable& table, std::int32_t place, bool augmented,
            const std::vector<std::int32_t>& key) {
  table.Append({.place = place, .augmented = augmented}, std::vector<std::uint16_t>(key.size() * 2),
               key, std::vector<std::int32_t>(2));
}

ContextTable RandomTable(std::mt19937_64& random, int num_places, int spread,
                         int num_rows = kNumRows) {
  ContextTable table(num_rows, 2);
  for (int place = 0; place < num_places; ++place) {
    for (int variant = 0; variant < 3; ++variant) {
      Append(table, place, variant > 0, RandomKey(random, spread, num_rows));
    }
  }
  return table;
}

/// The key distance of each place, nearest first, by looking at every entry.
std::vector<double> DistancesByHand(const ContextTable& table, const std::vector<std::int32_t>& key,
                                    bool augmented) {
  std::map<int, double> best;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table.entry(i).augmented && !augmented) continue;
    double sum = 0.0;
    for (int r = 0; r < table.num_rows(); ++r) {
      sum += std::pow((table.retrieval_key_cm(i)[r] - key[r]) * 0.01, 2);
    }
    const auto [it, is_new] = best.try_emplace(table.entry(i).place, std::sqrt(sum));
    if (!is_new) it->second = std::min(it->second, std::sqrt(sum));
  }
  std::vector<double> distances;
  for (const auto& [place, distance] : best) distances.push_back(distance);
  std::sort(distances.begin(), distances.end());
  return distances;
}

TEST(KeyIndex, FindsTheNearestPlacesEachOnce) {
  std::mt19937_64 random(1);
  // Shorter than what the tree looks at, just that, and longer by whole blocks of SIMD and not.
  for (const int num_rows : {1, 5, 8, 9, 20, 23}) {
    SCOPED_TRACE(num_rows);
    // Some dozen leaves.
    const ContextTable table = RandomTable(random, 2000, 5000, num_rows);
    const KeyIndex index(table);
    for (int i = 0; i < 25; ++i) {
      const std::vector<std::int32_t> key = RandomKey(random, 5000, num_rows);
      for (const bool augmented : {false, true}) {
        const std::vector<double> expected = DistancesByHand(table, key, augmented);
        const auto found = index.Search(key, 10, augmented);
        ASSERT_EQ(found.size(), 10U);
        std::set<int> places;
        for (std::size_t n = 0; n < found.size(); ++n) {
          EXPECT_NEAR(found[n].key_distance, expected[n], 1e-4);
          EXPECT_TRUE(augmented || !table.entry(found[n].entry).augmented);
          places.insert(table.entry(found[n].entry).place);
        }
        EXPECT_EQ(places.size(), found.size());
      }
    }
  }
}

TEST(KeyIndex, PassesOverExcludedPlaces) {
  std::mt19937_64 random(5);
  const ContextTable table = RandomTable(random, 50, 1000);
  const KeyIndex index(table);
  const std::vector<std::int32_t> key = RandomKey(random, 1000);
  const auto all = index.Search(key, 50, true);
  std::vector<bool> excluded(50);
  for (std::size_t i = 0; i < all.size(); i += 2) excluded[table.entry(all[i].entry).place] = true;
  const auto found = index.Search(key, 25, true, &excluded);
  ASSERT_EQ(found.size(), 25U);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].entry, all[2 * i + 1].entry);
}

TEST(KeyIndex, GivesAllPlacesWhenFewerThanAsked) {
  std::mt19937_64 random(2);
  const ContextTable table = RandomTable(random, 3, 100);
  const KeyIndex index(table);
  EXPECT_EQ(index.Search(RandomKey(random, 100), 10, true).size(), 3U);
  EXPECT_EQ(index.Search(RandomKey(random, 100), 10, false).size(), 3U);
}

TEST(KeyIndex, AnswersAnEmptyTableWithNothing) {
  const ContextTable table(kNumRows, 2);
  const KeyIndex index(table);
  EXPECT_TRUE(index.Search(std::vector<std::int32_t>(kNumRows), 1, true).empty());
}

TEST(KeyIndex, FindsTheSameHoweverItGrew) {
  std::mt19937_64 random(3);
  const int num_places = 2000;
  const ContextTable all = RandomTable(random, num_places, 5000, 20);
  ContextTable table(20, 2);
  KeyIndex grown(table);
  const auto append_place = [&](std::size_t place) {
    for (std::size_t i = 3 * place; i < 3 * place + 3; ++i) {
      table.Append(all.entry(i), all.context(i).cells_cm, all.retrieval_key_cm(i),
                   all.context(i).aligning_cm);
    }
  };
  for (std::size_t place = 0; place < num_places; ++place) {
    append_place(place);
    // Again, so that there are ties between trees.
    if (place % 7 == 0) append_place(place);
    if (place % 3 == 0) grown.Extend();
    if (place % 97 != 0) continue;
    const KeyIndex made_at_once(table);
    for (const std::vector<std::int32_t>& query :
         {RandomKey(random, 5000, 20), all.retrieval_key_cm(place / 7 * 7)}) {
      const auto expected = made_at_once.Search(query, 10, true);
      const auto found = grown.Search(query, 10, true);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t n = 0; n < found.size(); ++n) {
        EXPECT_EQ(found[n].entry, expected[n].entry);
        EXPECT_EQ(found[n].key_distance, expected[n].key_distance);
      }
    }
  }
}

TEST(KeyIndex, FindsFlipsThatTheTableDoesNotHold) {
  std::mt19937_64 random(11);
  ContextTable flips(20, 2);
  ContextTable all(20, 2);
  for (std::int32_t place = 0; place < 3000; ++place) {
    const std::vector<std::int32_t> key = RandomKey(random, 5000, 20);
    flips.AppendKey({.place = place}, key);
    flips.AppendFlipOfLast();
    all.AppendKey({.place = place}, key);
    all.AppendKey({.place = place, .flipped = true, .augmented = true},
                  std::vector<std::int32_t>(key.rbegin(), key.rend()));
  }
  std::vector<bool> excluded(3000);
  for (std::size_t place = 0; place < excluded.size(); place += 3) excluded[place] = true;
  const KeyIndex of_flips(flips);
  const KeyIndex of_all(all);
  for (int q = 0; q < 50; ++q) {
    const std::vector<std::int32_t> key =
        q % 2 == 0 ? RandomKey(random, 5000, 20) : all.retrieval_key_cm(random() % all.size());
    for (const bool augmented : {true, false}) {
      const auto expected = of_all.Search(key, 10, augmented, q % 3 == 0 ? &excluded : nullptr);
      const auto found = of_flips.Search(key, 10, augmented, q % 3 == 0 ? &excluded : nullptr);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t n = 0; n < found.size(); ++n) {
        EXPECT_EQ(found[n].entry, expected[n].entry);
        EXPECT_EQ(found[n].key_distance, expected[n].key_distance);
      }
    }
  }
}

TEST(KeyIndex, GivesTiesInOrderOfEntry) {
  ContextTable table(kNumRows, 2);
  // More than a leaf holds: keys that are all alike have no middle to be cut in.
  for (int place = 0; place < 1500; ++place) {
    Append(table, place, false, std::vector<std::int32_t>(kNumRows, 7));
  }
  const KeyIndex index(table);
  const auto found = index.Search(std::vector<std::int32_t>(kNumRows, 9), 4, true);
  ASSERT_EQ(found.size(), 4U);
  for (std::size_t n = 0; n < found.size(); ++n) EXPECT_EQ(found[n].entry, n);
}

}  // namespace
}  // namespace scanloc
