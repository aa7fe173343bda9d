// A map that is kept: loops closed, a drive of another frame brought in, edited.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "e2e/programs.hpp"
#include "support/scan_files.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// One fix of a receiver.
struct Fix {
  std::int64_t stamp_ns = 0;
  double latitude = 0.0;
  double longitude = 0.0;
  double altitude = 0.0;
};

/// An MCAP file of sensor_msgs/NavSatFix in CDR, as a ROS 2 robot records it, without an index.
std::string FixesAsMcap(const std::vector<Fix>& fixes) {
  const auto text = [](const std::string& value) {
    std::string bytes;
    AppendBytes(bytes, static_cast<std::uint32_t>(value.size()));
    return bytes + value;
  };
  std::string file = "\x89MCAP0\r\n";
  const auto add_record = [&file](char kind, const std::string& content) {
    file += kind;
    AppendBytes(file, static_cast<std::uint64_t>(content.size()));
    file += content;
  };
  const std::string one("\1\0", 2);
  add_record(1, text("ros2") + text("test"));
  add_record(3, one + text("sensor_msgs/msg/NavSatFix") + text("ros2msg") + text("# none"));
  add_record(4, one + one + text("/fix") + text("cdr") + text(""));
  for (const Fix& fix : fixes) {
    std::string message("\0\1\0\0", 4);
    AppendBytes(message, static_cast<std::int32_t>(fix.stamp_ns / 1'000'000'000));
    AppendBytes(message, static_cast<std::uint32_t>(fix.stamp_ns % 1'000'000'000));
    message += text(std::string("gps\0", 4)) + std::string("\0\0\1\0\0\0\0\0", 8);
    for (const double value : {fix.latitude, fix.longitude, fix.altitude}) {
      AppendBytes(message, value);
    }
    message += std::string(9 * 8 + 1, '\0');
    std::string record = one + std::string(4, '\0');
    AppendBytes(record, static_cast<std::uint64_t>(fix.stamp_ns));
    AppendBytes(record, static_cast<std::uint64_t>(fix.stamp_ns));
    add_record(5, record + message);
  }
  return file;
}

class LongLived : public testing::Test {
 protected:
  /// A drive of the town with odometry, and its folder.
  [[nodiscard]] std::string Drive(const std::string& name, const Args& more) const {
    Args args = {"simulate",         dir_.File(name),
                 "--town-seed",      "3",
                 "--length-m",       "500",
                 "--rays",           "24",
                 "--azimuths",       "512",
                 "--spacing-m",      "2",
                 "--odometry-noise", "1",
                 "--quiet"};
    args.insert(args.end(), more.begin(), more.end());
    MustScanloc(args);
    return dir_.File(name);
  }

  const TempDir dir_;
  const std::string map_ = dir_.File("map");
};

TEST_F(LongLived, ClosesLoopsAndWritesPosesInAllFormats) {
  const std::string drive = Drive("one", {"--to-m", "160"});
  const std::string kitti = dir_.File("closed.txt");
  const json told = json::parse(
      MustScanloc({"optimize", "--scans", drive, "--poses", drive + "/odometry.txt", "--truth",
                   drive + "/poses.txt", "--times", drive + "/times.txt", "--out", kitti, "--out",
                   dir_.File("closed.tum"), "--out", dir_.File("closed.g2o"), "--report",
                   dir_.File("report"), "--json", "--quiet"}));
  EXPECT_EQ(told.at("num_scans"), 80);
  EXPECT_FALSE(told.at("errors_after").at("ape_m").is_null());
  for (const char* file : {"report.html", "results.json", "loops.csv"}) {
    EXPECT_TRUE(fs::exists(dir_.File("report") + "/" + file)) << file;
  }
  std::ifstream g2o(dir_.File("closed.g2o"));
  std::string first;
  std::getline(g2o, first);
  EXPECT_EQ(first.rfind("VERTEX_SE3:QUAT 0 ", 0), 0U) << first;
  // Both are read again, by what reads any drive.
  for (const std::string& poses : {kitti, dir_.File("closed.tum")}) {
    MustScanloc({"build", poses + ".map", "--scans", drive, "--poses", poses, "--times",
                 drive + "/times.txt", "--quiet", "--no-calibrate"});
  }
  EXPECT_EQ(MustScanloc({"export", kitti + ".map"}).substr(0, 5), "place");
}

TEST_F(LongLived, TakesADriveOfAnotherFrameInAndLeavesItOutAgain) {
  const std::string first = Drive("one", {});
  const std::string second =
      Drive("two", {"--session-seed", "2", "--reverse", "--lane-shift-m", "3.5", "--to-m", "300"});
  MustScanloc({"build", map_, "--scans", first, "--poses", first + "/poses.txt", "--quiet",
               "--no-calibrate"});
  const std::string before = ContentId(map_);
  const ProcessResult refused = Scanloc({"build", map_, "--scans", second, "--poses",
                                         second + "/odometry.txt", "--append", "--quiet"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("into the map's frame first by --append --align. Nothing"),
            std::string::npos)
      << refused.err;
  const std::string told =
      MustScanloc({"build", map_, "--scans", second, "--poses", second + "/odometry.txt",
                   "--append", "--align", "--quiet", "--no-calibrate"});
  EXPECT_NE(told.find("  aligned     by "), std::string::npos) << told;
  // It stands in the frame of the map: the truth says so.
  const json found = json::parse(MustScanloc({"locate", map_, "--scans", second, "--truth",
                                              second + "/poses.txt", "--every", "7", "--json"}));
  EXPECT_EQ(found.at("summary").at("num_false"), 0);
  const std::string edited = dir_.File("edited");
  MustScanloc({"edit", map_, edited, "--drop-session", "two", "--quiet"});
  EXPECT_EQ(ContentId(edited), before);
  const json info = json::parse(MustScanloc({"info", edited, "--json"}));
  EXPECT_EQ(info.at("history")[0].at("command"), "edit --drop-session two");
  EXPECT_EQ(info.at("history")[0].at("parents")[0], ContentId(map_));
}

TEST_F(LongLived, RefusesADriveThatSharesNothingAndLeavesTheMapAsItWas) {
  const std::string first = Drive("one", {"--to-m", "200"});
  const std::string other = dir_.File("other");
  MustScanloc({"simulate", other, "--town-seed", "91", "--length-m", "200", "--rays", "24",
               "--azimuths", "512", "--spacing-m", "4", "--odometry-noise", "1", "--quiet"});
  MustScanloc({"build", map_, "--scans", first, "--poses", first + "/poses.txt", "--quiet",
               "--no-calibrate"});
  const std::string before = ContentId(map_);
  for (const Args& args : {Args{"align", map_, "--scans", other, "--poses", other + "/odometry.txt",
                                "--out", dir_.File("aligned.txt"), "--quiet"},
                           Args{"build", map_, "--scans", other, "--poses", other + "/odometry.txt",
                                "--append", "--align", "--quiet"}}) {
    const ProcessResult refused = Scanloc(args);
    EXPECT_EQ(refused.status, 1) << refused.out;
    EXPECT_EQ(CountLines(refused.err), 1) << refused.err;
    EXPECT_NE(refused.err.find("shares nothing with the map"), std::string::npos) << refused.err;
  }
  EXPECT_FALSE(fs::exists(dir_.File("aligned.txt")));
  EXPECT_EQ(ContentId(map_), before);
}

TEST_F(LongLived, NamesWhatWasRebuiltAndReplacesIt) {
  const std::string first = Drive("one", {});
  const std::string later =
      Drive("later", {"--session-seed", "2", "--lane-shift-m", "1", "--rebuilt-share", "0.3"});
  const Args drive = {"--scans", later, "--poses", later + "/poses.txt", "--quiet"};
  const auto with_drive = [&](Args args) {
    args.insert(args.end(), drive.begin(), drive.end());
    return args;
  };
  MustScanloc({"build", map_, "--scans", first, "--poses", first + "/poses.txt", "--quiet",
               "--no-calibrate"});
  const std::string before = ContentId(map_);
  const json changes = json::parse(
      MustScanloc(with_drive({"diff", map_, "--json", "--geojson", dir_.File("changes.geojson"),
                              "--picture", dir_.File("changes.svg")})));
  std::vector<double> from_rebuilt_m;
  std::ifstream rebuilt(later + "/rebuilt.txt");
  for (double m = 0.0; rebuilt >> m;) from_rebuilt_m.push_back(m);
  int num_rebuilt = 0;
  int num_named = 0;
  int num_wrongly_named = 0;
  for (const json& scan : changes.at("after").at("places")) {
    const double m = from_rebuilt_m.at(scan.at("place").get<std::size_t>());
    const bool is_changed = scan.at("change") == "changed";
    num_wrongly_named += m > 60.0 && is_changed ? 1 : 0;
    if (m >= 6.0) continue;
    ++num_rebuilt;
    num_named += is_changed ? 1 : 0;
  }
  ASSERT_GT(num_rebuilt, 10);
  EXPECT_GE(num_named * 10, num_rebuilt * 9);
  EXPECT_EQ(num_wrongly_named, 0);
  std::ifstream geojson(dir_.File("changes.geojson"));
  EXPECT_EQ(json::parse(geojson).at("features").size(),
            changes.at("before").at("num").get<std::size_t>() +
                changes.at("after").at("num").get<std::size_t>());
  EXPECT_TRUE(fs::exists(dir_.File("changes.svg")));

  const std::string fresh = dir_.File("fresh");
  const std::string told = MustScanloc(with_drive({"refresh", map_, fresh}));
  EXPECT_NE(told.find("  replaced  "), std::string::npos) << told;
  EXPECT_EQ(ContentId(map_), before);
  EXPECT_EQ(Scanloc({"verify", fresh}).status, 0);
  const json left = json::parse(MustScanloc(with_drive({"diff", fresh, "--json"})));
  EXPECT_LT(left.at("after").at("num_changed").get<int>() * 5,
            changes.at("after").at("num_changed").get<int>());
  const json between = json::parse(MustScanloc({"diff", map_, fresh, "--json"}));
  EXPECT_GT(between.at("before").at("num_changed").get<int>(), 0);
  const json info = json::parse(MustScanloc({"info", fresh, "--json"}));
  EXPECT_EQ(info.at("history")[0].at("parents")[0], before);
  EXPECT_EQ(Scanloc(with_drive({"refresh", map_, fresh})).status, 1) << "there is one";
}

TEST_F(LongLived, KnowsWhereOnEarthItIsAndTellsOtherPrograms) {
  const std::string drive = Drive("one", {"--to-m", "160"});
  MustScanloc({"build", map_, "--scans", drive, "--poses", drive + "/poses.txt", "--times",
               drive + "/times.txt", "--geo-origin", "48.1374,11.5755,519", "--quiet",
               "--no-calibrate"});
  const std::string csv = MustScanloc({"export", map_, "--grid", "mgrs"});
  EXPECT_NE(csv.find(",latitude,longitude,altitude,grid\n"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",32UP"), std::string::npos) << csv;
  const json points = json::parse(MustScanloc({"export", map_, "--format", "geojson"}));
  EXPECT_NEAR(points.at("features")[0].at("geometry").at("coordinates")[1].get<double>(), 48.1374,
              0.02);
  EXPECT_NE(MustScanloc({"export", map_, "--format", "kml"}).find("<coordinates>"),
            std::string::npos);
  EXPECT_NE(MustScanloc({"export", map_, "--format", "gpx"}).find("<trkpt lat=\"48.1"),
            std::string::npos);

  // Answers tell it, too: where the places near by are.
  const json asked =
      json::parse(MustScanloc({"locate", map_, "--scans", drive, "--every", "20", "--json"}));
  for (const json& query : asked.at("queries")) {
    const json& best = query.at("candidates")[0];
    const json& place =
        points.at("features")[best.at("place").get<std::size_t>()].at("geometry").at("coordinates");
    EXPECT_NEAR(best.at("geo").at("latitude").get<double>(), place[1].get<double>(), 1e-4);
    EXPECT_NEAR(best.at("geo").at("longitude").get<double>(), place[0].get<double>(), 1e-4);
  }

  // The fixes of a receiver along the drive say the same, in a map that does not know it yet.
  std::string fixes = "stamp,latitude,longitude,altitude\n";
  std::vector<Fix> recorded;
  for (const json& point : points.at("features")) {
    const json& at = point.at("geometry").at("coordinates");
    const auto stamp_ns = point.at("properties").at("stamp_ns").get<std::int64_t>();
    char row[120];
    std::snprintf(row, sizeof row, "%.9f,%.10f,%.10f,%.4f\n", static_cast<double>(stamp_ns) * 1e-9,
                  at[1].get<double>(), at[0].get<double>(), at[2].get<double>());
    fixes += row;
    recorded.push_back({stamp_ns, at[1].get<double>(), at[0].get<double>(), at[2].get<double>()});
  }
  EXPECT_EQ(
      Scanloc({"build", dir_.File("unbuilt"), "--scans", drive, "--poses", drive + "/poses.txt",
               "--geo-fixes", dir_.Write("bad.csv", "x,y\n"), "--quiet"})
          .status,
      1);
  EXPECT_FALSE(fs::exists(dir_.File("unbuilt"))) << "the file is looked at first";
  const std::string moved = dir_.File("moved");
  MustScanloc({"edit", map_, moved, "--transform", "10,20,0,0,0,90", "--quiet"});
  EXPECT_TRUE(json::parse(MustScanloc({"info", moved, "--json"})).at("geo_origin").is_null());
  EXPECT_EQ(Scanloc({"export", moved, "--format", "kml"}).status, 1);
  EXPECT_EQ(MustScanloc({"locate", moved, "--scans", drive, "--every", "20", "--csv", "-"})
                .find("latitude"),
            std::string::npos);
  for (const std::string& file :
       {dir_.Write("fixes.csv", fixes), dir_.Write("fixes.mcap", FixesAsMcap(recorded))}) {
    const std::string found = file + ".found";
    MustScanloc({"edit", moved, found, "--geo-fixes", file, "--quiet"});
    const json again = json::parse(MustScanloc({"export", found, "--format", "geojson"}));
    for (std::size_t i = 0; i < again.at("features").size(); ++i) {
      for (const int axis : {0, 1}) {
        EXPECT_NEAR(again.at("features")[i].at("geometry").at("coordinates")[axis].get<double>(),
                    points.at("features")[i].at("geometry").at("coordinates")[axis].get<double>(),
                    1e-6)
            << file;
      }
    }
  }
  EXPECT_EQ(
      Scanloc({"build", "m", "--scans", "x", "--poses", "y", "--geo-origin", "95,0,0"}).status, 2);
}

TEST_F(LongLived, RefusesWrongUsage) {
  EXPECT_EQ(Scanloc({"diff", "map"}).status, 2);
  EXPECT_EQ(Scanloc({"diff", "map", "other", "--scans", "x", "--poses", "y"}).status, 2);
  EXPECT_EQ(Scanloc({"refresh", "map", "out"}).status, 2);
  EXPECT_EQ(Scanloc({"edit", "in", "out"}).status, 2);
  EXPECT_EQ(Scanloc({"edit", "in", "out", "--crop", "1,2,3"}).status, 2);
  EXPECT_EQ(Scanloc({"edit", "in", "out", "--thin", "-1"}).status, 2);
  EXPECT_EQ(Scanloc({"edit", "in", "out", "--rename-session", "a"}).status, 2);
  EXPECT_EQ(Scanloc({"optimize", "--scans", "x", "--out", "y"}).status, 2);
  EXPECT_EQ(Scanloc({"build", "m", "--scans", "x", "--poses", "y", "--align"}).status, 2);
}

}  // namespace
}  // namespace scanloc::test
