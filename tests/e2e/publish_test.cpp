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

ProcessResult Publish(const TempDir& dir, const std::string& map, const std::string& region,
                      const Args& more = {}) {
  Args args = {"publish",     map,
               "--catalogue", dir.File("catalogue"),
               "--store",     dir.File("store"),
               "--region",    region,
               "--by",        "somebody"};
  args.insert(args.end(), more.begin(), more.end());
  return Scanloc(args);
}

TEST(Publish, PutsAMapInForceAndRollsItBack) {
  const TempDir dir;
  EXPECT_EQ(Catalogue(dir), json::array());
  EXPECT_EQ(Scanloc({"catalogue", "--catalogue", dir.File("catalogue")}).err,
            "no map is in force\n");
  ASSERT_EQ(Publish(dir, Town().map1, "town").status, 0);
  EXPECT_EQ(Scanloc({"catalogue", "twon", "--catalogue", dir.File("catalogue")}).err,
            "region twon never had a map\n");
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

TEST(Publish, SaysWhereARegionIs) {
  const TempDir dir;
  const auto area = [&](const std::string& map, const Args& more = {}) {
    const ProcessResult published = Publish(dir, map, "town", more);
    EXPECT_EQ(published.status, 0) << published.err;
    return Catalogue(dir).at(0).at("area");
  };
  const json in_map = area(Town().map1);
  EXPECT_EQ(in_map.at("on_earth"), false);
  EXPECT_GE(in_map.at("corners").size(), 2U);
  EXPECT_LE(in_map.at("corners").size(), TinyTown::kNumScans);
  EXPECT_EQ(area(Town().map1, {"--area", "-5,-6,7,8"}),
            json({{"on_earth", false}, {"corners", {{-5, -6}, {7, -6}, {7, 8}, {-5, 8}}}}));

  const std::string on_earth = dir.File("on-earth.scanloc");
  MustScanloc({"edit", Town().map1, on_earth, "--geo-origin", "48.1374,11.5755,519", "--quiet"});
  const json hull = area(on_earth);
  EXPECT_EQ(hull.at("on_earth"), true);
  for (const json& corner : hull.at("corners")) {
    EXPECT_NEAR(corner.at(0), 11.5755, 0.1);
    EXPECT_NEAR(corner.at(1), 48.1374, 0.1);
  }
  EXPECT_EQ(area(on_earth, {"--area", "11.5,48.1,11.6,48.1,11.6,48.2"}),
            json({{"on_earth", true}, {"corners", {{11.5, 48.1}, {11.6, 48.1}, {11.6, 48.2}}}}));
  const std::string file = dir.Write(
      "area.geojson",
      R"({"type": "Polygon", "coordinates": [[[11.5, 48], [11.6, 48], [11.6, 48.1], [11.5, 48]]]})");
  EXPECT_EQ(area(Town().map1, {"--area", file}),
            json({{"on_earth", true}, {"corners", {{11.5, 48}, {11.6, 48}, {11.6, 48.1}}}}));
  for (const std::string& bad :
       {std::string("1,2,3"), std::string("1,2"), dir.File("none"), std::string("11.5,48,200,49"),
        Town().map1, dir.path().string(), std::string("/dev/zero")}) {
    const ProcessResult result = Publish(dir, on_earth, "town", {"--area", bad});
    EXPECT_EQ(result.status, 1) << bad;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
  }
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

/// By GNU parallel, and by Slurm.
class BuildFleetTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    const bool is_slurm = GetParam();
    const std::string program = is_slurm ? "/usr/sbin/slurmctld" : "/usr/bin/parallel";
    if (!fs::exists(program)) GTEST_SKIP() << program << " is not installed";
    if (!is_slurm) return;
    cluster_ = std::make_unique<Process>(std::vector<std::string>{
        "/usr/bin/python3", SourceDir() + "/tests/support/slurm_cluster.py",
        cluster_dir_.File("")});
    const std::string configuration = cluster_->ReadLine();
    ASSERT_FALSE(configuration.empty());
    environment_.push_back("SLURM_CONF=" + configuration);
  }
  [[nodiscard]] ProcessResult Build() const {
    Args args = {SourceDir() + "/scripts/build_fleet.sh", dir_.File("all.scanloc"),
                 dir_.File("drives"), "--jobs", "2"};
    if (GetParam()) args.push_back("--slurm");
    args.insert(args.end(), {"--", "--spacing-m", "0"});
    return RunProcess(args, {.environment = environment_});
  }

  TempDir dir_, cluster_dir_;
  std::unique_ptr<Process> cluster_;
  std::vector<std::string> environment_ = {"SCANLOC=" + kScanloc};
};

TEST_P(BuildFleetTest, MergesDrivesThatAreBuiltSideBySideAndGoesOnWhereItWas) {
  fs::create_directories(dir_.File("drives"));
  fs::create_directory_symlink(Town().drive1, dir_.File("drives/one"));
  fs::create_directory_symlink(Town().drive2, dir_.File("drives/two"));
  const ProcessResult built = Build();
  ASSERT_EQ(built.status, 0) << built.err;
  const json info = json::parse(MustScanloc({"info", dir_.File("all.scanloc"), "--json"}));
  ASSERT_EQ(info.at("sessions").size(), 2U);
  EXPECT_EQ(info.at("sessions")[0].at("name"), "one");
  EXPECT_EQ(info.at("num_places"), 2 * TinyTown::kNumScans);
  MustScanloc({"verify", dir_.File("all.scanloc")});
  fs::remove(dir_.File("all.scanloc.parts/two.scanloc"));
  fs::remove(dir_.File("all.scanloc"));
  ASSERT_EQ(Build().status, 0);
  EXPECT_EQ(ContentId(dir_.File("all.scanloc")), info.at("content_id"));
}

TEST_P(BuildFleetTest, TellsOfADriveThatCannotBeBuilt) {
  fs::create_directories(dir_.File("drives/bad"));
  fs::create_directory_symlink(Town().drive1, dir_.File("drives/one"));
  dir_.Write("drives/bad/poses.txt", "no pose");
  const ProcessResult built = Build();
  EXPECT_EQ(built.status, 1) << built.err;
  EXPECT_FALSE(fs::exists(dir_.File("all.scanloc")));
}

INSTANTIATE_TEST_SUITE_P(By, BuildFleetTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "Slurm" : "GnuParallel");
});

}  // namespace
}  // namespace scanloc::test
