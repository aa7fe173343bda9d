#include "scanloc/mapdb/map_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/core/scan/descriptor.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::BuildSmallMap;
using test::TempDir;
using testing::HasSubstr;

// The map that the same scans give without a file between.
Map MapInMemory(const Params& params, const SessionPlan& plan, const ScanLoader& load_scan) {
  Map map = MakeEmptyMap(params);
  map.sessions.push_back(plan.name);
  auto describer = Describer::Create(params);
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    map.places.push_back({plan.scans[i].T_map_place, plan.scans[i].stamp_ns, 0});
    map.AppendDescriptor(static_cast<std::int32_t>(i), describer->DescribePlace(*load_scan(i)));
  }
  return map;
}

void ExpectLoadsWhatWasBuilt(const Params& params) {
  const TempDir dir;
  BuildOptions options = test::SmallOptions(dir.File("a.scanloc"));
  options.params = params;
  const SessionPlan plan = test::SmallPlan("one", 5);
  const auto summary = BuildMap(options, plan, test::SmallLoader());
  ASSERT_TRUE(summary.ok()) << summary.status();
  const auto loaded = LoadMap(options.path);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  Map expected = MapInMemory(params, plan, test::SmallLoader());
  expected.content_id = summary->content_id;
  EXPECT_TRUE(test::SameMap(*loaded, expected));
}

TEST(LoadMap, GivesWhatWasBuilt) { ExpectLoadsWhatWasBuilt(test::SmallParams()); }

TEST(LoadMap, GivesWhatWasBuiltWithThePapersParameters) { ExpectLoadsWhatWasBuilt(Params()); }

TEST(LoadMap, GivesAMapOfPolarContextsOnly) {
  Params params = test::SmallParams();
  params.cart.enabled = false;
  ExpectLoadsWhatWasBuilt(params);
}

TEST(LoadMap, GivesAMapOfCartContextsOnlyWithoutAugmentation) {
  Params params = test::SmallParams();
  params.polar.enabled = false;
  params.polar.root_shifts_m.clear();
  params.cart.double_flip = false;
  ExpectLoadsWhatWasBuilt(params);
}

TEST(ReadInfo, TellsWhatTheMapHolds) {
  const TempDir dir;
  const std::string path = dir.File("a.scanloc");
  const SessionPlan plan = test::SmallPlan("one", 5);
  const auto summary = BuildSmallMap(path, 5);
  ASSERT_TRUE(summary.ok()) << summary.status();
  const auto info = ReadInfo(path);
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->schema_version, 16);
  EXPECT_EQ(info->compatible_version, 9);
  EXPECT_THAT(info->built_by, HasSubstr("scanloc "));
  EXPECT_EQ(info->content_id, summary->content_id);
  EXPECT_EQ(info->content_id.size(), 32U);
  EXPECT_TRUE(info->complete);
  EXPECT_EQ(info->params, test::SmallParams());
  ASSERT_EQ(info->sessions.size(), 1U);
  EXPECT_EQ(info->sessions[0].name, "one");
  EXPECT_EQ(info->sessions[0].num_places, 5);
  EXPECT_EQ(info->sessions[0].first_stamp_ns, plan.scans.front().stamp_ns);
  EXPECT_EQ(info->sessions[0].last_stamp_ns, plan.scans.back().stamp_ns);
  EXPECT_EQ(info->num_scans, 5);
  EXPECT_EQ(info->num_places, 5);
  EXPECT_EQ(info->num_empty, 0);
  EXPECT_EQ(info->num_unreadable, 0);
  EXPECT_EQ(info->first_stamp_ns, plan.scans.front().stamp_ns);
  EXPECT_EQ(info->last_stamp_ns, plan.scans.back().stamp_ns);
  EXPECT_EQ(info->extent_m.min(), Eigen::Vector3d(0.0, 0.0, -0.25));
  EXPECT_EQ(info->extent_m.max(), plan.scans.back().T_map_place.translation());
  EXPECT_EQ(info->file_bytes, static_cast<std::int64_t>(std::filesystem::file_size(path)));
}

TEST(ReadPlaces, GivesThePlacesInTheOrderBuilt) {
  const TempDir dir;
  const SessionPlan plan = test::SmallPlan("one", 4);
  ASSERT_TRUE(BuildSmallMap(dir.File("a.scanloc"), 4).ok());
  const auto places = ReadPlaces(dir.File("a.scanloc"));
  ASSERT_TRUE(places.ok()) << places.status();
  ASSERT_EQ(places->size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ((*places)[i].scan, plan.scans[i].name);
    EXPECT_EQ((*places)[i].place.stamp_ns, plan.scans[i].stamp_ns);
    EXPECT_EQ((*places)[i].place.session, 0);
    EXPECT_EQ((*places)[i].place.T_map_place.matrix(), plan.scans[i].T_map_place.matrix());
    EXPECT_GT((*places)[i].num_voxels, 50U);
  }
}

}  // namespace
}  // namespace scanloc::mapdb
