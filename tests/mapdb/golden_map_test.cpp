// Every schema version ever released keeps a small map in tests/data, opened for ever after.
#include "support/golden_map.hpp"

#include <gtest/gtest.h>

#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/paths.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

struct Golden {
  int version;
  const char* content_id;
  int compatible_version = version;

  [[nodiscard]] std::string Path() const {
    return test::SourceDir() + "/tests/data/golden_map_v" + std::to_string(version) + ".scanloc";
  }
  [[nodiscard]] Params ParamsOf() const { return test::GoldenParams(version); }
  [[nodiscard]] PlaceDescriptor DescriptorOf(int seed) const {
    PlaceDescriptor descriptor = test::GoldenDescriptor(seed, version);
    if (version < 2) descriptor.structure = {};
    return descriptor;
  }
};

constexpr Golden kGoldens[] = {
    {1, "cfb06ece459fc7898dd2e31ec0f8b41b"},     {2, "fdba44550c143156202ea809d68c04e8"},
    {3, "c1e3c145e98f1c3f29e929981272aaea"},     {4, "94d186b8448cc438c3e5d4e73314e275", 3},
    {5, "94d186b8448cc438c3e5d4e73314e275", 3},  {6, "b29f9a8af2426d636b7ba0d4be6cd7ac", 3},
    {7, "a6adcf91d27fdd5c6e6eb403a6c870c5", 3},  {8, "4f42a5086c6944dcbef0abf4e3f1ab03"},
    {9, "6edaeb823e4aad6394f07048e0cdb07b"},     {10, "2e113ea2d047e102f22fcbaa655b8515", 9},
    {11, "c29552f0917c709b402bf0ee3df848b9", 9}, {12, "000707e7993d3595cc2357a5367e0e58", 9},
    {13, "19adaa1bed45754ad33f4f3462e940bf", 9}, {14, "a81937458e9c1591e73253450a126e6a", 9},
    {15, "b37f7938454b3018b34ac7e6a7221bd5", 9}, {16, "748073f720ebbf707d47f875036dd862", 9}};

class GoldenMap : public testing::TestWithParam<Golden> {};

TEST_P(GoldenMap, IsSound) {
  const auto problems = FindProblems(GetParam().Path());
  ASSERT_TRUE(problems.ok()) << problems.status();
  EXPECT_TRUE(problems->empty()) << problems->front();
}

TEST_P(GoldenMap, TellsWhatItHolds) {
  const auto info = ReadInfo(GetParam().Path());
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->schema_version, GetParam().version);
  EXPECT_EQ(info->compatible_version, GetParam().compatible_version);
  EXPECT_EQ(info->built_by, "scanloc 0.1.0");
  EXPECT_EQ(info->content_id, GetParam().content_id);
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

TEST_P(GoldenMap, LoadsWithTheContentItWasMadeOf) {
  const auto map = LoadMap(GetParam().Path());
  ASSERT_TRUE(map.ok()) << map.status();
  Map expected = MakeEmptyMap(GetParam().ParamsOf());
  expected.content_id = GetParam().content_id;
  expected.sessions = {"morning", "evening"};
  const SessionPlan morning = test::GoldenPlan("morning", 3);
  const SessionPlan evening = test::GoldenPlan("evening", 2);
  expected.places = {{morning.scans[0].T_map_place, morning.scans[0].stamp_ns, 0},
                     {morning.scans[2].T_map_place, morning.scans[2].stamp_ns, 0},
                     {evening.scans[0].T_map_place, evening.scans[0].stamp_ns, 1}};
  for (int i = 0; i < 3; ++i) expected.AppendDescriptor(i, GetParam().DescriptorOf(i));
  EXPECT_TRUE(test::SameMap(*map, expected));
}

TEST_P(GoldenMap, OpensWithTheBearingsOfItsPosts) {
  const auto map = OpenMap(GetParam().Path());
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->payload != nullptr, GetParam().version >= 5);
  BearingTable expected;
  for (int i = 0; i < 3 && map->params.structure.enabled; ++i) {
    expected.push_back(BearingsOf(GetParam().DescriptorOf(i).structure.posts, map->params));
  }
  EXPECT_EQ(map->bearings, expected);
}

TEST_P(GoldenMap, IsResumed) {
  const test::TempDir dir;
  const std::string copy = dir.Write("copy.scanloc", test::ReadFile(GetParam().Path()));
  auto builder = MapBuilder::Resume(copy, GetParam().ParamsOf(), test::GoldenPlan("evening", 2));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(builder->next_scan(), 1U);
  ASSERT_TRUE(builder->Add(GetParam().DescriptorOf(3)).ok());
  EXPECT_TRUE(builder->Finish().ok());
  EXPECT_TRUE(FindProblems(copy)->empty());
}

INSTANTIATE_TEST_SUITE_P(OfEverySchema, GoldenMap, testing::ValuesIn(kGoldens),
                         [](const auto& golden) {
                           return "V" + std::to_string(golden.param.version);
                         });

TEST(GoldenMapOfToday, GetsTheSameContentIdWhenBuiltAgain) {
  const test::TempDir dir;
  ASSERT_TRUE(test::MakeGoldenMap(dir.File("new.scanloc")).ok());
  EXPECT_EQ(ReadInfo(dir.File("new.scanloc"))->content_id, std::end(kGoldens)[-1].content_id);
}

}  // namespace
}  // namespace scanloc::mapdb
