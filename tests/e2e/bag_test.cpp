// Bags on the command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "e2e/programs.hpp"
#include "support/paths.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(BagOnTheCommandLine, ListsTopics) {
  const json document = json::parse(MustScanloc({"bag", BagPath("zstd.mcap"), "--json"}));
  ASSERT_EQ(document.at("topics").size(), 5U);
  EXPECT_EQ(document.at("topics")[1].at("name"), "/points");
  EXPECT_EQ(document.at("topics")[1].at("type"), "sensor_msgs/PointCloud2");
  EXPECT_EQ(document.at("topics")[1].at("num_messages"), 7);
  EXPECT_EQ(document.at("topics")[1].at("first_ns"), 1700000000000000000);
  const std::string table = MustScanloc({"bag", BagPath("ros1_lz4.bag")});
  EXPECT_THAT(table, HasSubstr("nav_msgs/Odometry"));
  EXPECT_EQ(CountLines(table), 6);
}

TEST(BagOnTheCommandLine, BuildsLocatesAndEvaluates) {
  const TempDir dir;
  const std::string map = dir.File("posts.scanloc");
  MustScanloc({"build", map, "--bag", BagPath("ros2"), "--poses-from", "/odom", "--no-calibrate",
               "--spacing-m", "0", "--quiet"});
  const json info = json::parse(MustScanloc({"info", map, "--json"}));
  EXPECT_EQ(info.at("num_places"), 7);
  EXPECT_EQ(info.at("sessions")[0].at("name"), "ros2");
  const std::string csv =
      MustScanloc({"locate", map, "--bag", BagPath("zstd.mcap"), "--csv", "-", "--quiet"});
  EXPECT_EQ(CountLines(csv), 8) << csv;
  EXPECT_THAT(csv, HasSubstr("\n1700000000.100000000,"));
  MustScanloc({"locate", map, "--bag", BagPath("zstd.mcap"), "--sequence", "--poses-from", "/odom",
               "--quiet"});
  const report::CsvTable judged =
      ParseCsv(MustScanloc({"locate", map, "--bag", BagPath("zstd.mcap"), "--poses-from", "/odom",
                            "--bag-truth", "--csv", "-", "--quiet"}));
  ASSERT_EQ(judged.num_rows(), 7U);
  EXPECT_NE(judged.Text(0, "true_x"), "");
  const json eval =
      json::parse(MustScanloc({"eval", map, "--bag", BagPath("zstd.mcap"), "--poses-from",
                               "tf:odom", "--method", "pc", "--json", "--quiet"}));
  EXPECT_EQ(eval.at("num_queries"), 7);
}

TEST(BagOnTheCommandLine, SaysInOneLineWhatCannotBeRead) {
  const TempDir dir;
  for (const auto& [args, reason] : std::vector<std::pair<Args, std::string>>{
           {{"bag", dir.File("none.bag")}, "none.bag"},
           {{"build", dir.File("m"), "--bag", BagPath("zstd.mcap")}, "several topics of poses"},
           {{"build", dir.File("m"), "--bag", BagPath("zstd.mcap"), "--topic", "/x"}, "/points"},
           {{"locate", Town().map1, "--bag", BagPath("zstd.mcap"), "--bag-truth"},
            "several topics of poses"},
           {{"locate", Town().map1, "--bag", dir.Write("x.mcap", "MCAP")}, "is no bag"}}) {
    const ProcessResult result = Scanloc(args);
    EXPECT_EQ(result.status, 1) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(reason));
    EXPECT_FALSE(std::filesystem::exists(dir.File("m")));
  }
}

TEST(BagOnTheCommandLine, BuildsNoMapOfCloudsThatShowNothing) {
  const TempDir dir;
  const ProcessResult result = Scanloc({"build", dir.File("m"), "--bag", BagPath("all_nan.mcap"),
                                        "--poses-from", "/odom", "--spacing-m", "0", "--quiet"});
  EXPECT_EQ(result.status, 1) << result.err;
  EXPECT_THAT(
      result.err,
      HasSubstr("none of the 7 scans of session 'all_nan' makes a place: 7 have no point in "
                "range, of 0 points in all. Nothing was written; beside these, 49 points "
                "that are not finite were left out"));
  EXPECT_FALSE(std::filesystem::exists(dir.File("m")));
}

}  // namespace
}  // namespace scanloc::test
