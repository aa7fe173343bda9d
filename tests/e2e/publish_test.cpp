// Maps that are published, rolled back and told of; drives that are built many at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json Catalogue(const TempDir& dir, const Args& more = {}) {
  Args args = {"catalogue", "--catalogue", dir.File("catalogue"), "--json"};
  args.insert(args.end(), more.begin(), more.end());
  return json::parse(MustScanloc(args));
}

ProcessResult Publish(const TempDir& dir, const std::string& map, const std::string& region) {
  return Scanloc({"publish", map, "--catalogue", dir.File("catalogue"), "--store",
                  dir.File("store"), "--region", region, "--by", "somebody"});
}

TEST(Publish, PutsAMapInForceAndRollsItBack) {
  const TempDir dir;
  EXPECT_EQ(Catalogue(dir), json::array());
  ASSERT_EQ(Publish(dir, Town().map1, "town").status, 0);
  const std::string second = dir.File("second.scanloc");
  MustScanloc({"build", second, "--scans", Town().drive2, "--poses", Town().Poses2(), "--spacing-m",
               "0", "--quiet"});
  ASSERT_EQ(Publish(dir, second, "town").status, 0);
  json live = Catalogue(dir);
  ASSERT_EQ(live.size(), 1U);
  EXPECT_EQ(live[0].at("content_id"), ContentId(second));
  EXPECT_EQ(live[0].at("published_by"), "somebody");
  const fs::path stored = fs::path(dir.File("store")) / live[0].at("file").get<std::string>();
  EXPECT_EQ(ReadFile(stored), ReadFile(second));
  MustScanloc({"rollback", "town", "--catalogue", dir.File("catalogue")});
  EXPECT_EQ(Catalogue(dir)[0].at("content_id"), ContentId(Town().map1));
  const json history = Catalogue(dir, {"town"});
  ASSERT_EQ(history.size(), 2U);
  EXPECT_EQ(history[0].at("live"), false);
  EXPECT_EQ(history[1].at("live"), true);
  MustScanloc(
      {"rollback", "town", "--catalogue", dir.File("catalogue"), "--to", ContentId(second)});
  EXPECT_EQ(Catalogue(dir)[0].at("content_id"), ContentId(second));
  MustScanloc({"rollback", "town", "--catalogue", dir.File("catalogue"), "--withdraw"});
  EXPECT_EQ(Catalogue(dir), json::array());
}

TEST(Publish, RefusesWhatCannotBeServed) {
  const TempDir dir;
  std::string bytes = ReadFile(Town().map1);
  bytes[bytes.size() / 2] ^= 0x55;
  const std::string damaged = dir.Write("damaged.scanloc", bytes);
  for (const auto& [map, region] :
       {std::pair{damaged, "town"}, {Town().map1, "../town"}, {dir.File("none.scanloc"), "town"}}) {
    const ProcessResult result = Publish(dir, map, region);
    EXPECT_EQ(result.status, 1) << map;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
  }
  EXPECT_EQ(Catalogue(dir), json::array());
  EXPECT_EQ(Scanloc({"rollback", "town", "--catalogue", dir.File("catalogue")}).status, 1);
  EXPECT_EQ(Scanloc({"publish", Town().map1, "--region", "town"}).status, 2);
}

TEST(BuildFleet, MergesDrivesThatAreBuiltSideBySideAndGoesOnWhereItWas) {
  if (!fs::exists("/usr/bin/parallel")) GTEST_SKIP() << "GNU parallel is not installed";
  const TempDir dir;
  fs::create_directories(dir.File("drives"));
  fs::create_directory_symlink(Town().drive1, dir.File("drives/one"));
  fs::create_directory_symlink(Town().drive2, dir.File("drives/two"));
  const auto build = [&] {
    return RunProcess({SourceDir() + "/scripts/build_fleet.sh", dir.File("all.scanloc"),
                       dir.File("drives"), "--jobs", "2", "--", "--spacing-m", "0"},
                      {.environment = {"SCANLOC=" + kScanloc}});
  };
  const ProcessResult built = build();
  ASSERT_EQ(built.status, 0) << built.err;
  const json info = json::parse(MustScanloc({"info", dir.File("all.scanloc"), "--json"}));
  ASSERT_EQ(info.at("sessions").size(), 2U);
  EXPECT_EQ(info.at("sessions")[0].at("name"), "one");
  EXPECT_EQ(info.at("num_places"), 2 * TinyTown::kNumScans);
  MustScanloc({"verify", dir.File("all.scanloc")});
  fs::remove(dir.File("all.scanloc.parts/two.scanloc"));
  fs::remove(dir.File("all.scanloc"));
  ASSERT_EQ(build().status, 0);
  EXPECT_EQ(ContentId(dir.File("all.scanloc")), info.at("content_id"));
}

}  // namespace
}  // namespace scanloc::test
