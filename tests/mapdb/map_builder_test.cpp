#include "scanloc/mapdb/map_builder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <limits>

#include "scanloc/core/limits.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::SmallParams;
using test::SmallPlan;
using testing::HasSubstr;

PlaceDescriptor SmallDescriptor(std::uint32_t seed) {
  auto describer = Describer::Create(SmallParams());
  return describer->DescribePlace(test::SmallScan(seed));
}

void ExpectStatus(const absl::Status& status, absl::StatusCode code, const std::string& message) {
  EXPECT_EQ(status.code(), code) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(message));
}

// Adds scans up to index `end`, each its own, and gives the builder's last status.
absl::Status AddUpTo(MapBuilder& builder, std::size_t end) {
  while (builder.next_scan() < end) {
    const auto seed = static_cast<std::uint32_t>(builder.next_scan() + 1);
    if (absl::Status status = builder.Add(SmallDescriptor(seed)); !status.ok()) return status;
  }
  return absl::OkStatus();
}

class MapBuilderTest : public testing::Test {
 protected:
  MapBuilder Created(std::size_t num_scans) {
    auto builder = MapBuilder::Create(path_, SmallParams(), SmallPlan("one", num_scans));
    EXPECT_TRUE(builder.ok()) << builder.status();
    return *std::move(builder);
  }
  // A map whose session "one" has `num_done` of `num_scans`.
  void Build(std::size_t num_scans, std::size_t num_done) {
    MapBuilder builder = Created(num_scans);
    EXPECT_TRUE(AddUpTo(builder, num_done).ok());
    EXPECT_TRUE(builder.Commit().ok());
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

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
  EXPECT_TRUE(Verify(path_)->empty());
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

TEST_F(MapBuilderTest, ResumesBehindTheLastCommit) {
  Build(5, 2);
  auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 5));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 2U);
  EXPECT_EQ(builder->num_places(), 2);
  ASSERT_TRUE(AddUpTo(*builder, 5).ok());
  const auto content_id = builder->Finish();
  ASSERT_TRUE(content_id.ok()) << content_id.status();

  path_ = dir_.File("unbroken.scanloc");
  Build(5, 5);
  EXPECT_EQ(*content_id, ReadInfo(path_)->content_id);
}

TEST_F(MapBuilderTest, ResumesBehindSkippedScans) {
  {
    MapBuilder builder = Created(4);
    ASSERT_TRUE(builder.Skip(SkipReason::kEmpty).ok());
    ASSERT_TRUE(AddUpTo(builder, 2).ok());
    ASSERT_TRUE(builder.Skip(SkipReason::kEmpty).ok());
    ASSERT_TRUE(builder.Commit().ok());
  }
  const auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 4));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 3U);
  EXPECT_EQ(builder->num_places(), 1);
}

TEST_F(MapBuilderTest, ResumesAnAppendedSession) {
  Build(2, 2);
  { ASSERT_TRUE(MapBuilder::Append(path_, SmallPlan("two", 3)).ok()); }
  auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("two", 3));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 0U);
  ASSERT_TRUE(AddUpTo(*builder, 3).ok());
  EXPECT_TRUE(builder->Finish().ok());
  EXPECT_EQ(LoadMap(path_)->places.back().session, 1);
}

TEST_F(MapBuilderTest, ResumesWhatIsNotThereYetByCreatingIt) {
  auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 2));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 0U);
}

TEST_F(MapBuilderTest, ResumesAnEmptyFile) {
  path_ = dir_.Write("empty", "");
  auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 2));
  ASSERT_TRUE(builder.ok()) << builder.status();
  ASSERT_TRUE(AddUpTo(*builder, 2).ok());
  EXPECT_TRUE(builder->Finish().ok());
  EXPECT_EQ(LoadMap(path_)->places.size(), 2U);
}

TEST_F(MapBuilderTest, LeavesAFinishedSessionAsItIs) {
  Build(3, 3);
  const std::string before = test::ReadFile(path_);
  auto builder = MapBuilder::Resume(path_, SmallParams(), SmallPlan("one", 3));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 3U);
  const auto content_id = builder->Finish();
  ASSERT_TRUE(content_id.ok()) << content_id.status();
  EXPECT_EQ(*content_id, ReadInfo(path_)->content_id);
  EXPECT_EQ(test::ReadFile(path_), before);
}

TEST_F(MapBuilderTest, ResumesNothingOfAnotherPlan) {
  Build(4, 2);
  const std::pair<std::function<void(SessionPlan&)>, std::string> changes[] = {
      {[](SessionPlan& plan) { plan.name = "two"; }, "named 'one', not 'two'"},
      {[](SessionPlan& plan) { plan.scans.pop_back(); }, "has 4 scans, not 3"},
      {[](SessionPlan& plan) { plan.scans[1].name = "x.bin"; }, "'000001.bin' is not among"},
      {[](SessionPlan& plan) { std::swap(plan.scans[0], plan.scans[1]); }, "another order"},
      {[](SessionPlan& plan) { plan.scans[1].stamp_ns = 9; }, "not 9 ns"},
      {[](SessionPlan& plan) { plan.scans[1].T_map_place.translation().x() += 1e-9; },
       "'000001.bin' has another pose"},
      {[](SessionPlan& plan) { plan.scans[3].name = "x.bin"; }, "not yet in the map"}};
  for (const auto& [change, message] : changes) {
    SessionPlan plan = SmallPlan("one", 4);
    change(plan);
    ExpectStatus(MapBuilder::Resume(path_, SmallParams(), plan).status(),
                 absl::StatusCode::kFailedPrecondition, message);
  }
}

TEST_F(MapBuilderTest, ResumesNothingOfOtherParameters) {
  Build(4, 2);
  Params params = SmallParams();
  params.sensor_height_m = 1.73;
  ExpectStatus(MapBuilder::Resume(path_, params, SmallPlan("one", 4)).status(),
               absl::StatusCode::kFailedPrecondition, "sensor_height_m is '2', not '1.73'");
}

TEST_F(MapBuilderTest, ResumesNoOtherSessionBehindAFinishedOne) {
  Build(2, 2);
  ExpectStatus(MapBuilder::Resume(path_, SmallParams(), SmallPlan("two", 2)).status(),
               absl::StatusCode::kFailedPrecondition, "--append");
}

}  // namespace
}  // namespace scanloc::mapdb
