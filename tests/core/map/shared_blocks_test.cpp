#include "scanloc/core/map/shared_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "scanloc/core/map/map.hpp"

namespace scanloc {
namespace {

/// So many that some blocks are full, whatever the odds.
constexpr std::size_t kNumKeys = 4 * kMaxBlock;

/// Keys of two sums.
std::vector<std::array<std::int32_t, 2>> RandomKeys(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::array<std::int32_t, 2>> keys(kNumKeys);
  for (auto& [a, b] : keys) {
    a = static_cast<std::int32_t>(random() % 60'000);
    b = static_cast<std::int32_t>(random() % 60'000);
  }
  return keys;
}

ContextTable TableOf(const std::vector<std::array<std::int32_t, 2>>& keys) {
  ContextTable table(2, 2);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    table.AppendKey({.place = static_cast<std::int32_t>(i)}, keys[i]);
  }
  return table;
}

/// For each full block whether the other table holds it, too.
std::vector<bool> SharedWith(const ContextTable& other, const ContextTable& table) {
  std::vector<bool> is_shared;
  const auto& others = other.key_blocks().full();
  for (const auto& block : table.key_blocks().full()) {
    is_shared.push_back(std::find(others.begin(), others.end(), block) != others.end());
  }
  return is_shared;
}

std::size_t CountUnshared(const ContextTable& other, ContextTable& table) {
  table.ShareKeysWith(other);
  const std::vector<bool> is_shared = SharedWith(other, table);
  return static_cast<std::size_t>(std::count(is_shared.begin(), is_shared.end(), false));
}

TEST(SharedBlocks, EndWithinTheirBoundsAndHoldAllInOrder) {
  const auto keys = RandomKeys(1);
  const ContextTable table = TableOf(keys);
  const std::vector<std::size_t>& ends = table.key_blocks().ends();
  ASSERT_GE(ends.size(), 4U);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::size_t length = ends[i] - (i == 0 ? 0 : ends[i - 1]);
    EXPECT_GE(length, kMinBlock);
    EXPECT_LE(length, kMaxBlock);
  }
  for (std::size_t i = 0; i < keys.size(); ++i) {
    ASSERT_TRUE(std::ranges::equal(table.retrieval_key_cm(i), keys[i])) << i;
  }
}

TEST(SharedBlocks, EndAtTheLatestWhenTheyAreAsLongAsAllowed) {
  ContextTable table(1, 1);
  // Of these keys, all alike, none ends a block.
  for (std::size_t i = 0; i < kMaxBlock; ++i) table.AppendKey({.place = 0}, std::vector{7});
  EXPECT_EQ(table.key_blocks().ends(), std::vector{kMaxBlock});
}

TEST(SharedBlocks, AreAllSharedWhereATableIsAppendedTo) {
  auto keys = RandomKeys(2);
  const ContextTable before = TableOf(keys);
  const auto more = RandomKeys(3);
  keys.insert(keys.end(), more.begin(), more.end());
  ContextTable after = TableOf(keys);
  const std::size_t num_full = after.key_blocks().full().size();
  const std::size_t num_before = before.key_blocks().full().size();
  ASSERT_GT(num_full, num_before);
  EXPECT_EQ(CountUnshared(before, after), num_full - num_before);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    ASSERT_TRUE(std::ranges::equal(after.retrieval_key_cm(i), keys[i])) << i;
  }
}

TEST(SharedBlocks, AreNotSharedWhereAKeyWasChangedTakenOutOrPutIn) {
  const auto keys = RandomKeys(4);
  const ContextTable before = TableOf(keys);
  const std::size_t in_third = before.key_blocks().ends()[1] + 1000;

  auto changed = keys;
  ++changed[in_third][1];
  ContextTable after = TableOf(changed);
  EXPECT_EQ(CountUnshared(before, after), 1U);
  EXPECT_FALSE(SharedWith(before, after)[2]);
  EXPECT_EQ(after.retrieval_key_cm(in_third)[1], keys[in_third][1] + 1);

  changed = keys;
  changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(in_third));
  after = TableOf(changed);
  EXPECT_EQ(CountUnshared(before, after), 1U) << "those behind it stay as they are";
  EXPECT_FALSE(SharedWith(before, after)[2]);

  changed = keys;
  changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(in_third), {{1, 2}});
  after = TableOf(changed);
  EXPECT_EQ(CountUnshared(before, after), 1U);
  EXPECT_FALSE(SharedWith(before, after)[2]);
}

TEST(SharedBlocks, TellSumsApartThatDifferBeyondSixteenBits) {
  auto keys = RandomKeys(5);
  keys[5] = {1, 2};
  const ContextTable before = TableOf(keys);
  keys[5] = {65'536 + 1, 2};
  ContextTable after = TableOf(keys);
  EXPECT_EQ(CountUnshared(before, after), 1U);
  EXPECT_EQ(after.retrieval_key_cm(5), (std::vector{65'537, 2}));
  ContextTable again = TableOf(keys);
  EXPECT_EQ(CountUnshared(after, again), 0U) << "such a block is shared, too";
  EXPECT_EQ(again.retrieval_key_cm(5), (std::vector{65'537, 2}));
}

TEST(SharedBlocks, AreNotSharedWithKeysOfAnotherLength) {
  // The same sums one behind the other, if cut in another way.
  ContextTable one(1, 2);
  ContextTable two(2, 2);
  for (std::size_t i = 0; i < 2 * kMaxBlock; ++i) {
    if (i % 2 == 0) two.AppendKey({.place = 0}, std::vector{7, 7});
    one.AppendKey({.place = 0}, std::vector{7});
  }
  ASSERT_FALSE(two.key_blocks().full().empty());
  two.ShareKeysWith(one);
  EXPECT_EQ(SharedWith(one, two), std::vector{false});
}

TEST(SharedBlocks, OfACopyStayAsTheyAreWhenTheOtherGrows) {
  const auto keys = RandomKeys(6);
  ContextTable table = TableOf(keys);
  const ContextTable copy = table;
  for (int i = 0; i < 10; ++i) table.AppendKey({.place = 0}, std::vector{1, 2});
  EXPECT_EQ(copy.key_blocks().size(), keys.size());
  EXPECT_TRUE(std::ranges::equal(copy.retrieval_key_cm(keys.size() - 1), keys.back()));
}

TEST(SharedBlocks, OfBearingsAreSharedAsThoseOfKeys) {
  std::mt19937_64 random(7);
  Map before = MakeEmptyMap(Params());
  Map after = before;
  for (std::size_t place = 0; place < kMaxBlock + 1000; ++place) {
    BearingGrid::Rings rings{};
    rings[place % rings.size()] = random();
    before.bearings.push_back(BearingGrid(rings));
    if (place == 0) rings[0] = 1;
    after.bearings.push_back(BearingGrid(rings));
  }
  EXPECT_FALSE(before.bearings == after.bearings);
  after.ShareWith(before);
  const auto& full = after.bearings.blocks().full();
  ASSERT_GE(full.size(), 2U) << "choose another seed";
  EXPECT_NE(full[0], before.bearings.blocks().full()[0]);
  EXPECT_EQ(full[1], before.bearings.blocks().full()[1]);
  Map equal = before;
  EXPECT_TRUE(equal.bearings == before.bearings);
}

}  // namespace
}  // namespace scanloc
