// Builds that were stopped, taken up again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "map_builder_fixture.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"

namespace scanloc::mapdb {
namespace {

using test::SmallParams;
using test::SmallPlan;
using testing::HasSubstr;

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
