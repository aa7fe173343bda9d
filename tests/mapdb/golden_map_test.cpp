// Every schema version ever released keeps a small map in tests/data, opened for ever after.
#include "support/golden_map.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/paths.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

constexpr char kContentIdV1[] = "cfb06ece459fc7898dd2e31ec0f8b41b";
const std::string kGoldenV1 = test::SourceDir() + "/tests/data/golden_map_v1.scanloc";

TEST(GoldenMapV1, IsSound) {
  const auto problems = Verify(kGoldenV1);
  ASSERT_TRUE(problems.ok()) << problems.status();
  EXPECT_TRUE(problems->empty()) << problems->front();
}

TEST(GoldenMapV1, TellsWhatItHolds) {
  const auto info = ReadInfo(kGoldenV1);
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->schema_version, 1);
  EXPECT_EQ(info->compatible_version, 1);
  EXPECT_EQ(info->built_by, "scanloc 0.1.0");
  EXPECT_EQ(info->content_id, kContentIdV1);
  EXPECT_FALSE(info->complete);
  ASSERT_EQ(info->sessions.size(), 2U);
  EXPECT_EQ(info->sessions[0].name, "morning");
  EXPECT_EQ(info->sessions[0].num_places, 2);
  EXPECT_EQ(info->sessions[0].num_empty, 1);
  EXPECT_TRUE(info->sessions[0].complete());
  EXPECT_EQ(info->sessions[1].name, "evening");
  EXPECT_EQ(info->sessions[1].num_scans, 2);
  EXPECT_EQ(info->sessions[1].num_places, 1);
  EXPECT_EQ(info->first_stamp_ns, 1'500'000'000'000'000'000);
  EXPECT_EQ(info->last_stamp_ns, 1'500'000'001'000'000'000);
}

TEST(GoldenMapV1, LoadsWithTheContentItWasMadeOf) {
  const auto map = LoadMap(kGoldenV1);
  ASSERT_TRUE(map.ok()) << map.status();
  Map expected = MakeEmptyMap(test::SmallParams());
  expected.content_id = kContentIdV1;
  expected.sessions = {"morning", "evening"};
  const SessionPlan morning = test::GoldenPlan("morning", 3);
  const SessionPlan evening = test::GoldenPlan("evening", 2);
  expected.places = {{morning.scans[0].T_map_place, morning.scans[0].stamp_ns, 0},
                     {morning.scans[2].T_map_place, morning.scans[2].stamp_ns, 0},
                     {evening.scans[0].T_map_place, evening.scans[0].stamp_ns, 1}};
  for (int i = 0; i < 3; ++i) expected.AppendContexts(i, test::GoldenDescriptor(i));
  EXPECT_TRUE(test::SameMap(*map, expected));
}

TEST(GoldenMapV1, IsResumed) {
  const test::TempDir dir;
  const std::string copy = dir.Write("copy.scanloc", test::ReadFile(kGoldenV1));
  auto builder = MapBuilder::Resume(copy, test::SmallParams(), test::GoldenPlan("evening", 2));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 1U);
  ASSERT_TRUE(builder->Add(test::GoldenDescriptor(3)).ok());
  EXPECT_TRUE(builder->Finish().ok());
  EXPECT_TRUE(Verify(copy)->empty());
}

TEST(GoldenMapV1, GetsTheSameContentIdWhenBuiltToday) {
  const test::TempDir dir;
  ASSERT_TRUE(test::MakeGoldenMap(dir.File("new.scanloc")).ok());
  EXPECT_EQ(ReadInfo(dir.File("new.scanloc"))->content_id, kContentIdV1);
}

}  // namespace
}  // namespace scanloc::mapdb
