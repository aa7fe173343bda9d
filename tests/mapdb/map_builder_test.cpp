#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <limits>

#include "map_builder_fixture.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"

namespace scanloc::mapdb {
namespace {

using test::SmallParams;
using test::SmallPlan;
using testing::HasSubstr;

TEST_F(MapBuilderTest, CountsPlacesAndSkippedScans) {
  MapBuilder builder = Created(4);
  EXPECT_EQ(builder.next_scan(), 0U);
  ASSERT_TRUE(builder.Add(SmallDescriptor(1)).ok());
  ASSERT_TRUE(builder.Skip(SkipReason::kEmpty).ok());
  ASSERT_TRUE(builder.Skip(SkipReason::kUnreadable).ok());
  ASSERT_TRUE(builder.Add(SmallDescriptor(2)).ok());
  EXPECT_EQ(builder.next_scan(), 4U);
  EXPECT_EQ(builder.num_places(), 2);
  const auto content_id = builder.Finish();
  ASSERT_TRUE(content_id.ok()) << content_id.status();

  const auto info = ReadInfo(path_);
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->content_id, *content_id);
  EXPECT_TRUE(info->complete);
  EXPECT_EQ(info->num_places, 2);
  EXPECT_EQ(info->num_empty, 1);
  EXPECT_EQ(info->num_unreadable, 1);
  const auto places = ReadPlaces(path_);
  ASSERT_EQ(places->size(), 2U);
  EXPECT_EQ((*places)[1].scan, "000003.bin");
}

TEST_F(MapBuilderTest, LosesWhatWasNotCommitted) {
  {
    MapBuilder builder = Created(5);
    ASSERT_TRUE(AddUpTo(builder, 3).ok());
    ASSERT_TRUE(builder.Commit().ok());
    ASSERT_TRUE(AddUpTo(builder, 5).ok());
  }
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->places.size(), 3U);
  EXPECT_FALSE(ReadInfo(path_)->complete);
}

TEST_F(MapBuilderTest, LeavesAMapWithoutPlacesThatCanBeLoaded) {
  { Created(5); }
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_TRUE(map->places.empty());
  const auto info = ReadInfo(path_);
  EXPECT_TRUE(info->extent_m.isEmpty());
  EXPECT_FALSE(info->complete);
}

TEST_F(MapBuilderTest, LetsReadersSeeTheLastCommitWhileItWrites) {
  MapBuilder builder = Created(5);
  ASSERT_TRUE(AddUpTo(builder, 2).ok());
  ASSERT_TRUE(builder.Commit().ok());
  ASSERT_TRUE(AddUpTo(builder, 4).ok());
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->places.size(), 2U);
  ASSERT_TRUE(AddUpTo(builder, 5).ok());
  EXPECT_TRUE(builder.Finish().ok());
  EXPECT_EQ(LoadMap(path_)->places.size(), 5U);
}

TEST_F(MapBuilderTest, KeepsOtherBuildersOutUntilItIsFinished) {
  MapBuilder builder = Created(2);
  for (int commits = 0; commits < 2; ++commits) {
    ExpectStatus(MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 2)).status(),
                 absl::StatusCode::kUnavailable, "in use by another build");
    ExpectStatus(MapBuilder::Append(path_, SmallPlan("two", 2)).status(),
                 absl::StatusCode::kUnavailable, "in use by another build");
    ASSERT_TRUE(AddUpTo(builder, 1).ok());
    ASSERT_TRUE(builder.Commit().ok());
  }
  ASSERT_TRUE(AddUpTo(builder, 2).ok());
  ASSERT_TRUE(builder.Finish().ok());
  EXPECT_TRUE(MapBuilder::Append(path_, SmallPlan("two", 2)).ok());
}

TEST_F(MapBuilderTest, DoesNotFinishBeforeTheLastScan) {
  MapBuilder builder = Created(3);
  ASSERT_TRUE(AddUpTo(builder, 2).ok());
  ExpectStatus(builder.Finish().status(), absl::StatusCode::kFailedPrecondition, "1 scans");
  ASSERT_TRUE(AddUpTo(builder, 3).ok());
  EXPECT_TRUE(builder.Finish().ok());
}

TEST_F(MapBuilderTest, TakesNoMoreScansThanPlanned) {
  MapBuilder builder = Created(1);
  ASSERT_TRUE(AddUpTo(builder, 1).ok());
  ExpectStatus(builder.Add(SmallDescriptor(1)), absl::StatusCode::kFailedPrecondition, "all 1");
  ExpectStatus(builder.Skip(SkipReason::kEmpty), absl::StatusCode::kFailedPrecondition, "all 1");
  const auto first = builder.Finish();
  const auto second = builder.Finish();
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(*first, *second);
}

TEST_F(MapBuilderTest, RefusesDescriptorsOfOtherShapesAndGoesOn) {
  MapBuilder builder = Created(1);
  EXPECT_EQ(builder.Add(PlaceDescriptor()).code(), absl::StatusCode::kInvalidArgument);
  PlaceDescriptor descriptor = SmallDescriptor(1);
  descriptor.cart.cells_cm[0] = Context::kMaxHeight_cm + 1;
  EXPECT_EQ(builder.Add(descriptor).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(builder.next_scan(), 0U);
  EXPECT_TRUE(AddUpTo(builder, 1).ok());
  EXPECT_TRUE(builder.Finish().ok());
}

TEST_F(MapBuilderTest, SaysThatItsFileWasRemoved) {
  MapBuilder builder = Created(3);
  ASSERT_TRUE(AddUpTo(builder, 1).ok());
  ASSERT_TRUE(builder.Commit().ok());
  std::filesystem::remove(path_);
  absl::Status status = AddUpTo(builder, 3);
  status.Update(builder.Commit());
  ExpectStatus(status, absl::StatusCode::kFailedPrecondition, "moved, replaced or removed");
}

TEST_F(MapBuilderTest, CreatesNothingOverAnExistingFile) {
  const std::string path = dir_.Write("mine", "precious");
  ExpectStatus(MapBuilder::Create(path, SmallParams(), SmallPlan("one", 2)).status(),
               absl::StatusCode::kAlreadyExists, path);
  EXPECT_EQ(test::ReadFile(path), "precious");
  ExpectStatus(
      MapBuilder::Create(dir_.path().string(), SmallParams(), SmallPlan("one", 2)).status(),
      absl::StatusCode::kAlreadyExists, "already");
}

TEST_F(MapBuilderTest, CreatesNothingInAFolderThatDoesNotExist) {
  ExpectStatus(
      MapBuilder::Create(dir_.File("no/a.scanloc"), SmallParams(), SmallPlan("one", 2)).status(),
      absl::StatusCode::kNotFound, "make its folder");
}

TEST_F(MapBuilderTest, CreatesNothingOfANameThatIsTooLongForItsJournal) {
  for (const std::size_t length : {248, 255, 256}) {
    const std::string path = dir_.File(std::string(length, 'n'));
    ExpectStatus(MapBuilder::Create(path, SmallParams(), SmallPlan("one", 1)).status(),
                 absl::StatusCode::kInvalidArgument, "too long");
    EXPECT_TRUE(std::filesystem::is_empty(dir_.path())) << length;
  }
  const std::string longest = dir_.File(std::string(247, 'n'));
  EXPECT_TRUE(MapBuilder::Create(longest, SmallParams(), SmallPlan("one", 1)).ok());
}

TEST_F(MapBuilderTest, TellsOfNoJournalWhereTheLastDescriptorWentToTheMap) {
  Build(1, 1);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const int free = dup(STDOUT_FILENO);
  close(free);
  const rlimit one_more = {.rlim_cur = static_cast<rlim_t>(free) + 1, .rlim_max = before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &one_more), 0);
  const absl::Status status = LoadMap(path_).status();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  ExpectStatus(status, absl::StatusCode::kUnavailable, "the limit of open files");
}

TEST_F(MapBuilderTest, ReadsAMapWhoseJournalWouldHaveTooLongAName) {
  const std::string path = dir_.File(std::string(255, 'n'));
  Build(1, 1);
  std::filesystem::rename(path_, path);
  const auto map = LoadMap(path);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->places.size(), 1U);
}

TEST_F(MapBuilderTest, CreatesNothingOfBadParameters) {
  Params params = SmallParams();
  params.voxel_size_m = -1.0;
  ExpectStatus(MapBuilder::Create(path_, params, SmallPlan("one", 2)).status(),
               absl::StatusCode::kInvalidArgument, "voxel_size_m");
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(MapBuilderTest, RefusesBadPlans) {
  const std::pair<std::function<void(SessionPlan&)>, std::string> changes[] = {
      {[](SessionPlan& plan) { plan.name.clear(); }, "session"},
      {[](SessionPlan& plan) { plan.name = "a\nb"; }, "session"},
      {[](SessionPlan& plan) { plan.name = "\xff"; }, "session"},
      {[](SessionPlan& plan) { plan.name = std::string(256, 'x'); }, "256 bytes"},
      {[](SessionPlan& plan) { plan.scans.clear(); }, "no scan"},
      {[](SessionPlan& plan) { plan.scans[1].name.clear(); }, "scan 1"},
      {[](SessionPlan& plan) { plan.scans[1].T_map_place.translation().x() = 2e8; }, "scan 1"},
      {[](SessionPlan& plan) { plan.scans[1].T_map_place.linear() *= 1.01; }, "scan 1"},
      {[](SessionPlan& plan) { plan.scans[1].T_map_place.linear() *= -1.0; }, "scan 1"},
      {[](SessionPlan& plan) {
         plan.scans[1].T_map_place.translation().z() = std::numeric_limits<double>::quiet_NaN();
       },
       "000001.bin"}};
  for (const auto& [change, message] : changes) {
    SessionPlan plan = SmallPlan("one", 2);
    change(plan);
    for (const absl::Status& status : {MapBuilder::Create(path_, SmallParams(), plan).status(),
                                       MapBuilder::Append(path_, plan).status(),
                                       MapBuilder::Resume(path_, SmallParams(), plan).status()}) {
      ExpectStatus(status, absl::StatusCode::kInvalidArgument, message);
    }
    EXPECT_FALSE(std::filesystem::exists(path_));
  }
}

TEST_F(MapBuilderTest, AppendsAFurtherSession) {
  Build(3, 3);
  const std::string content_id_before = ReadInfo(path_)->content_id;
  auto builder = MapBuilder::Append(path_, SmallPlan("two", 2));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->params(), SmallParams());
  EXPECT_EQ(builder->num_places(), 3);
  ASSERT_TRUE(AddUpTo(*builder, 2).ok());
  ASSERT_TRUE(builder->Finish().ok());
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->sessions, (std::vector<std::string>{"one", "two"}));
  ASSERT_EQ(map->places.size(), 5U);
  EXPECT_EQ(map->places[2].session, 0);
  EXPECT_EQ(map->places[3].session, 1);
  EXPECT_NE(map->content_id, content_id_before);
  EXPECT_TRUE(FindProblems(path_)->empty());
}

TEST_F(MapBuilderTest, AppendsNothingToAnUnfinishedSession) {
  Build(3, 2);
  ExpectStatus(MapBuilder::Append(path_, SmallPlan("two", 2)).status(),
               absl::StatusCode::kFailedPrecondition, "2 of 3 scans; finish it with --resume");
}

TEST_F(MapBuilderTest, AppendsNoSessionOfANameThatIsTaken) {
  Build(3, 3);
  ExpectStatus(MapBuilder::Append(path_, SmallPlan("one", 2)).status(),
               absl::StatusCode::kAlreadyExists, "'one'");
}

TEST_F(MapBuilderTest, AppendsNothingToWhatIsNoMap) {
  ExpectStatus(MapBuilder::Append(path_, SmallPlan("one", 2)).status(), absl::StatusCode::kNotFound,
               path_);
  ExpectStatus(MapBuilder::Append(dir_.Write("empty", ""), SmallPlan("one", 2)).status(),
               absl::StatusCode::kInvalidArgument, "is empty");
  const std::string text = dir_.Write("text", std::string(4000, 'x'));
  ExpectStatus(MapBuilder::Append(text, SmallPlan("one", 2)).status(),
               absl::StatusCode::kInvalidArgument, "not an SQLite file");
  EXPECT_EQ(test::ReadFile(text), std::string(4000, 'x'));
}

}  // namespace
}  // namespace scanloc::mapdb
