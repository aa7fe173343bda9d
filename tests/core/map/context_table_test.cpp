#include "scanloc/core/map/context_table.hpp"

#include <gtest/gtest.h>

namespace scanloc {
namespace {

TEST(ContextTable, KeepsSumsOfAnySize) {
  ContextTable table(3, 2);
  const std::vector<std::vector<std::int32_t>> keys = {
      {0, 65'535, 7}, {65'536, 1, 2}, {491'460, 65'535, 327'640}, {4, 5, 6}};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    table.AppendKey({.place = static_cast<std::int32_t>(i)}, keys[i]);
  }
  for (std::size_t i = 0; i < keys.size(); ++i) EXPECT_EQ(table.retrieval_key_cm(i), keys[i]);
}

/// In any order, though places that all have the same entries take less memory.
TEST(ContextTable, TellsItsEntriesApart) {
  using Entry = ContextTable::Entry;
  const Entry own{0, 0.0F, false, false};
  const Entry left{0, -2.0F, false, true};
  const Entry own_of_1{1, 0.0F, false, false};
  const Entry left_of_1{1, -2.0F, false, true};
  for (const std::vector<Entry>& entries :
       {std::vector<Entry>{own, left, own_of_1, left_of_1, {2, 0.0F, false, false}},
        {own, left, {ContextTable::kMaxPlace, 2.0F, true, true}, {1, 0.0F, true, false}},
        {own, left, own_of_1, left_of_1, {1, 2.0F, false, true}},
        {own, left, left_of_1, own_of_1},
        {own, own, left},
        {own_of_1, left_of_1, own}}) {
    ContextTable table(1, 1);
    for (const Entry& entry : entries) table.AppendKey(entry, std::vector{1});
    ASSERT_EQ(table.size(), entries.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      EXPECT_EQ(table.entry(i).place, entries[i].place);
      EXPECT_EQ(table.entry(i).root_shift_m, entries[i].root_shift_m);
      EXPECT_EQ(table.entry(i).flipped, entries[i].flipped);
      EXPECT_EQ(table.entry(i).augmented, entries[i].augmented);
    }
  }
}

TEST(ContextTable, FlipsKeysThatAreHeldAlone) {
  ContextTable table(3, 2);
  table.AppendKey({.place = 4}, std::vector{1, 2, 3});
  table.AppendFlipOfLast();
  EXPECT_FALSE(table.holds_contexts());
  EXPECT_EQ(table.retrieval_key_cm(1), (std::vector{3, 2, 1}));
  EXPECT_TRUE(table.entry(1).flipped);
  EXPECT_TRUE(table.entry(1).augmented);
}

}  // namespace
}  // namespace scanloc
