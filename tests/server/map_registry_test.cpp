#include "scanloc/server/map_registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "scanloc/mapdb/map_file.hpp"
#include "support/full_block.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

TEST(MapRegistry, IsLoadingUntilItServes) {
  MapRegistry maps({"town"});
  EXPECT_EQ(maps.Find("town").status().code(), absl::StatusCode::kUnavailable);
  ASSERT_EQ(maps.List().size(), 1U);
  EXPECT_EQ(maps.List()[0].state, MapState::kLoading);

  ASSERT_TRUE(maps.Serve("town", "file", test::SmallMap(1, 4)).ok());
  const auto map = maps.Find("town");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ((*map)->info.content_id, "content-1");
  EXPECT_EQ((*map)->info.num_places, 4);
  EXPECT_EQ((*map)->info.generation, 1U);
  EXPECT_EQ((*map)->signature, DescriptorSignature(Params()));
  EXPECT_EQ(maps.List()[0].state, MapState::kServing);
}

TEST(MapRegistry, TellsTheBoxOfThePlaces) {
  MapRegistry maps({"town", "empty"});
  const Map map = test::SmallMap(1, 5);
  ASSERT_TRUE(maps.Serve("town", "file", map).ok());
  const auto extent = (*maps.Find("town"))->info.extent;
  ASSERT_TRUE(extent.has_value());
  EXPECT_EQ(extent->min_m, map.places.front().T_map_place.translation());
  EXPECT_EQ(extent->max_m, map.places.back().T_map_place.translation());

  ASSERT_TRUE(maps.Serve("empty", "file", MakeEmptyMap(Params())).ok());
  EXPECT_FALSE((*maps.Find("empty"))->info.extent.has_value());
}

TEST(MapRegistry, TakesTheEmptyNameForTheOnlyMap) {
  MapRegistry one({"town"});
  ASSERT_TRUE(one.Serve("town", "file", test::SmallMap(1, 2)).ok());
  EXPECT_TRUE(one.Find("").ok());

  MapRegistry two({"north", "south"});
  const absl::Status status = two.Find("").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("north, south"));
}

TEST(MapRegistry, TakesTheEmptyNameForTheOnlyMapThatDidNotFail) {
  MapRegistry maps({"north", "south"});
  maps.SetFailed("north");
  EXPECT_EQ(maps.Find("").status().code(), absl::StatusCode::kUnavailable) << "south still loads";
  ASSERT_TRUE(maps.Serve("south", "file", test::SmallMap(1, 2)).ok());
  EXPECT_EQ((*maps.Find(""))->info.name, "south");
  ASSERT_TRUE(maps.Serve("north", "file", test::SmallMap(2, 2)).ok());
  EXPECT_EQ(maps.Find("").status().code(), absl::StatusCode::kNotFound);
}

TEST(MapRegistry, ListsTheNamesItKnows) {
  MapRegistry maps({"north", "south"});
  const absl::Status status = maps.Find("east\n").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("north, south"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"east\\n\""));
}

TEST(MapRegistry, DoesNotListNamesWithoutEnd) {
  std::vector<std::string> names;
  for (int i = 0; i < 500; ++i) names.push_back("map" + std::to_string(i));
  const std::string message(MapRegistry(names).Find("none").status().message());
  EXPECT_LT(message.size(), 1000U);
  EXPECT_THAT(message, HasSubstr("and 480 more"));
}

TEST(MapRegistry, ServesNoNameThatIsNotConfigured) {
  MapRegistry maps({"town"});
  EXPECT_EQ(maps.Serve("village", "file", test::SmallMap(1, 2)).code(),
            absl::StatusCode::kNotFound);
}

TEST(MapRegistry, KeepsTheMapBeforeWhenTheNextIsBad) {
  MapRegistry maps({"town"});
  ASSERT_TRUE(maps.Serve("town", "file", test::SmallMap(1, 2)).ok());
  Map bad = test::SmallMap(2, 2);
  bad.params.voxel_size_m = -1;
  EXPECT_EQ(maps.Serve("town", "file", std::move(bad)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ((*maps.Find("town"))->info.content_id, "content-1");
}

TEST(MapRegistry, SwapsWhileOthersRead) {
  MapRegistry maps({"town"});
  ASSERT_TRUE(maps.Serve("town", "file", test::SmallMap(1, 2)).ok());
  const auto held = *maps.Find("town");
  std::atomic<bool> stop = false;
  std::thread reader([&] {
    std::uint64_t newest = 0;
    while (!stop) {
      const auto map = maps.Find("town");
      ASSERT_TRUE(map.ok()) << map.status();
      ASSERT_GE((*map)->info.generation, newest);
      newest = (*map)->info.generation;
    }
  });
  for (int i = 2; i <= 20; ++i) {
    EXPECT_TRUE(maps.Serve("town", "file", test::SmallMap(i, 2)).ok());
  }
  stop = true;
  reader.join();
  EXPECT_EQ((*maps.Find("town"))->info.generation, 20U);
  EXPECT_EQ(held->info.content_id, "content-1");
}

TEST(MapRegistry, HoldsTheKeysOfAMapThatWasAppendedToOnceAndAnswersAsLoadedAnew) {
  const test::TempDir dir;
  const std::string path = dir.File("town.scanloc");
  test::BuildFullBlock(path);
  MapRegistry maps({"town"});
  ASSERT_TRUE(maps.Serve("town", path, *mapdb::OpenMap(path)).ok());
  auto before = *maps.Find("town");
  const auto blocks = test::BlocksOf(*before->localizer);
  ASSERT_EQ(blocks.size(), 1U);

  test::AppendToFullBlock(path);
  ASSERT_TRUE(
      maps.Serve("town", path, *mapdb::OpenMap(path, {.before = &before->localizer->map()})).ok());
  before.reset();
  MapRegistry anew({"town"});
  ASSERT_TRUE(anew.Serve("town", path, *mapdb::OpenMap(path)).ok());

  const Localizer& reloaded = *(*maps.Find("town"))->localizer;
  EXPECT_EQ(test::BlocksOf(reloaded), blocks);
  test::ExpectSameAnswers(reloaded, *(*anew.Find("town"))->localizer);
}

}  // namespace
}  // namespace scanloc::server
