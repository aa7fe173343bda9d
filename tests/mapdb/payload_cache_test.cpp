#include "payload_cache.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace scanloc::mapdb {
namespace {

using testing::ElementsAre;
using testing::IsNull;
using testing::NotNull;

std::shared_ptr<const Payload> PayloadOf(std::size_t num_cells) {
  return std::make_shared<const Payload>(Payload{std::vector<std::uint16_t>(num_cells), {}, {}});
}

std::shared_ptr<const Payload> Find(PayloadCache& cache, const PayloadCache::Row& row) {
  return cache.Find(std::span(&row, 1)).front();
}

TEST(PayloadCache, LosesWhatWasUsedLongestAgo) {
  PayloadCache cache(70'000);  // three of 20,000 and some bytes
  for (std::uint64_t row = 0; row < 3; ++row) cache.Add({1, row}, PayloadOf(10'000));
  EXPECT_NE(Find(cache, {1, 0}), nullptr);
  cache.Add({1, 3}, PayloadOf(10'000));
  const std::vector<PayloadCache::Row> rows = {{1, 0}, {1, 1}, {1, 2}, {1, 3}};
  const std::vector<std::shared_ptr<const Payload>> found = cache.Find(rows);
  EXPECT_THAT(found, ElementsAre(NotNull(), IsNull(), NotNull(), NotNull()));
}

TEST(PayloadCache, TakesNothingThatIsLargerThanItself) {
  PayloadCache cache(1'000);
  cache.Add({1, 1}, PayloadOf(10'000));
  EXPECT_EQ(Find(cache, {1, 1}), nullptr);
}

TEST(PayloadCache, ForgetsAMapAlone) {
  PayloadCache cache(1'000'000);
  const std::uint64_t one = cache.NewMap();
  const std::uint64_t other = cache.NewMap();
  for (const std::uint64_t map : {one, other}) cache.Add({map, 7}, PayloadOf(10));
  cache.Forget(one);
  EXPECT_EQ(Find(cache, {one, 7}), nullptr);
  EXPECT_NE(Find(cache, {other, 7}), nullptr);
}

TEST(PayloadCache, KeepsOneOfARow) {
  PayloadCache cache(50'000);
  const auto first = PayloadOf(10'000);
  cache.Add({1, 1}, first);
  for (int i = 0; i < 10; ++i) cache.Add({1, 1}, PayloadOf(10'000));
  EXPECT_EQ(Find(cache, {1, 1}), first);
  cache.Add({1, 2}, PayloadOf(10'000));
  EXPECT_NE(Find(cache, {1, 1}), nullptr);
}

}  // namespace
}  // namespace scanloc::mapdb
