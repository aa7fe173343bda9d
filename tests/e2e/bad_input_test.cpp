// Scans, poses, maps and answers that are not as they should be: one clear line, status 1.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;

/// A copy of drive 1 that a test may damage.
class DamagedDrive {
 public:
  DamagedDrive() { fs::copy(Town().drive1, dir_.File("drive"), fs::copy_options::recursive); }

  [[nodiscard]] std::string Scan(const std::string& name) const {
    return dir_.File("drive/velodyne/" + name);
  }
  void SetScan(const std::string& name, const std::string& bytes) const {
    dir_.Write("drive/velodyne/" + name, bytes);
  }
  [[nodiscard]] std::string folder() const { return dir_.File("drive"); }
  [[nodiscard]] std::string map() const { return dir_.File("map.scanloc"); }

  [[nodiscard]] ProcessResult Build(const Args& more = {}) const {
    Args args = {"build",     map(),  "--scans",     folder(), "--poses", folder() + "/poses.txt",
                 "--session", "some", "--spacing-m", "0",      "--quiet"};
    args.insert(args.end(), more.begin(), more.end());
    return Scanloc(args);
  }

  TempDir dir_;
};

void ExpectOneLine(const ProcessResult& result, const std::string& part) {
  EXPECT_EQ(result.status, 1) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_EQ(result.err.rfind("scanloc ", 0), 0U) << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << "no \"" << part << "\" in " << result.err;
}

TEST(BadInput, ScanThatCannotBeReadStopsTheBuildByName) {
  const DamagedDrive drive;
  const std::string whole = ReadFile(drive.Scan("000011.bin"));
  for (const std::string& bytes :
       {std::string(), whole.substr(0, whole.size() / 2 - 3), std::string(4096, '\x7F')}) {
    drive.SetScan("000011.bin", bytes);
    const ProcessResult built = drive.Build({"--resume"});
    ExpectOneLine(built, "000011.bin");
    ExpectOneLine(built, "--skip-bad-scans");
  }
  drive.SetScan("000011.bin", whole);
  EXPECT_EQ(drive.Build({"--resume"}).status, 0);
  EXPECT_EQ(ContentId(drive.map()).size(), 32U);
}

TEST(BadInput, ScansThatCannotBeReadArePassedOverWhenAsked) {
  const DamagedDrive drive;
  drive.SetScan("000003.bin", "");
  drive.SetScan("000011.bin", "garbage");
  const ProcessResult built = drive.Build({"--skip-bad-scans"});
  ASSERT_EQ(built.status, 0) << built.err;
  EXPECT_NE(built.out.find("2 that could not be read"), std::string::npos) << built.out;
  EXPECT_NE(built.out.find("000003.bin"), std::string::npos) << built.out;
  EXPECT_NE(built.out.find("28 new"), std::string::npos) << built.out;

  const Args locate = {"locate", Town().map1, "--scans", drive.folder(), "--csv", "-", "--quiet"};
  const ProcessResult stopped = Scanloc(locate);
  ExpectOneLine(stopped, "000003.bin");
  ExpectOneLine(stopped, "--skip-bad-scans");
  Args skipping = locate;
  skipping.push_back("--skip-bad-scans");
  const ProcessResult located = Scanloc(skipping);
  ASSERT_EQ(located.status, 0) << located.err;
  EXPECT_EQ(CountLines(located.out), TinyTown::kNumScans - 2 + 1);
  EXPECT_NE(located.err.find("skipped 2 of 30"), std::string::npos) << located.err;
}

TEST(BadInput, SingleScanThatCannotBeReadIsAnError) {
  const TempDir dir;
  for (const char* bytes : {"", "garbage"}) {
    ExpectOneLine(Scanloc({"locate", Town().map1, "--scan", dir.Write("scan.bin", bytes),
                           "--skip-bad-scans"}),
                  "scan.bin");
  }
  ExpectOneLine(Scanloc({"locate", Town().map1, "--scan", dir.File("none.bin")}), "none.bin");
  ExpectOneLine(Scanloc({"locate", Town().map1, "--scan", dir.File("")}), dir.File(""));
}

TEST(BadInput, ScanWithoutAPointInRangeIsAnswered) {
  const TempDir dir;
  const std::string far =
      dir.Write("far.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n900 0 0\n");
  const ProcessResult result =
      Scanloc({"locate", Town().map1, "--scan", far, "--csv", "-", "--quiet"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.out.find("far.ply,insufficient_scan,,,,,,,,,,,,,,,,,,,,\n"), std::string::npos)
      << result.out;
}

TEST(BadInput, ScansAndPosesMustAgreeInNumber) {
  const DamagedDrive more_scans;
  more_scans.SetScan("000030.bin", ReadFile(more_scans.Scan("000000.bin")));
  ExpectOneLine(more_scans.Build(), "31");
  const DamagedDrive fewer_scans;
  fs::remove(fewer_scans.Scan("000029.bin"));
  ExpectOneLine(fewer_scans.Build(), "29");
  EXPECT_FALSE(fs::exists(fewer_scans.map())) << "nothing is begun that cannot end";
  ExpectOneLine(Scanloc({"locate", Town().map1, "--scans", fewer_scans.folder(), "--truth",
                         fewer_scans.folder() + "/poses.txt", "--quiet"}),
                "29");
}

TEST(BadInput, PosesMustBePoses) {
  const DamagedDrive drive;
  const std::string poses = ReadFile(drive.folder() + "/poses.txt");
  for (const char* first : {"nan 0 0 0 0 1 0 0 0 0 1 0\n", "2 0 0 0 0 2 0 0 0 0 2 0\n",
                            "1 0 0 0 0 1 0 0 0 0 1\n", "one 0 0 0 0 1 0 0 0 0 1 0\n"}) {
    drive.dir_.Write("drive/poses.txt", first + poses.substr(poses.find('\n') + 1));
    ExpectOneLine(drive.Build(), "poses.txt");
    EXPECT_FALSE(fs::exists(drive.map()));
  }
  fs::remove(drive.folder() + "/poses.txt");
  ExpectOneLine(drive.Build(), "poses.txt");
}

TEST(BadInput, FoldersMustHoldScans) {
  const TempDir dir;
  fs::create_directory(dir.File("empty"));
  for (const char* folder : {"none", "empty"}) {
    ExpectOneLine(Scanloc({"build", dir.File("map"), "--scans", dir.File(folder), "--poses",
                           Town().Poses1()}),
                  folder);
    ExpectOneLine(Scanloc({"locate", Town().map1, "--scans", dir.File(folder)}), folder);
  }
  ExpectOneLine(Scanloc({"locate", Town().map1, "--scans", Town().drive1, "--from", "30"}),
                "--from");
}

TEST(BadInput, OutputThatExistsIsLeftAsItIs) {
  const TempDir dir;
  const std::string kept = dir.Write("kept", "something else");
  ExpectOneLine(Scanloc(BuildArgs(kept)), kept);
  ExpectOneLine(Scanloc({"merge", kept, Town().map1}), kept);
  EXPECT_EQ(ReadFile(kept), "something else");
  const std::string map = dir.Write("map", ReadFile(Town().map1));
  ExpectOneLine(Scanloc(BuildArgs(map)), map);
  EXPECT_EQ(ReadFile(map), ReadFile(Town().map1));
  ExpectOneLine(Scanloc({"simulate", Town().drive1, "--length-m", "20"}), Town().drive1);
  const std::string loop = dir.File("loop");
  fs::create_symlink(loop, loop);
  const Args refresh = {"refresh", Town().map1,     loop,     "--scans", Town().drive1,
                        "--poses", Town().Poses1(), "--quiet"};
  for (const Args& args : {BuildArgs(loop), Args{"merge", loop, Town().map1}, refresh}) {
    ExpectOneLine(Scanloc(args), "there is a file '" + loop + "' already");
  }
}

TEST(BadInput, SessionNamesAreUniqueInAMap) {
  const TempDir dir;
  const std::string map = dir.Write("map", ReadFile(Town().map1));
  Args again = BuildArgs(map);
  again.push_back("--append");
  ExpectOneLine(Scanloc(again), "one");
  EXPECT_EQ(ReadFile(map), ReadFile(Town().map1));
  ExpectOneLine(Scanloc({"merge", dir.File("merged"), Town().map1, map}), "one");
}

TEST(BadInput, MapMustBeAMap) {
  const TempDir dir;
  const std::string whole = ReadFile(Town().map1);
  const Args bad = {dir.File("none"), dir.Write("garbage", "garbage"), dir.Write("empty", ""),
                    dir.Write("short", whole.substr(0, whole.size() / 3)), dir.File("")};
  for (const std::string& map : bad) {
    SCOPED_TRACE(map);
    ExpectOneLine(Scanloc({"info", map}), map);
    ExpectOneLine(Scanloc({"locate", map, "--scans", Town().drive1, "--quiet"}), map);
    ExpectOneLine(Scanloc({"export", map}), map);
    ExpectOneLine(Scanloc({"merge", dir.File("out"), map}), map);
    EXPECT_EQ(Scanloc({"verify", map}).status, 1);
    EXPECT_FALSE(fs::exists(dir.File("out")));
  }
}

TEST(BadInput, NothingWaitsForPipesOrReadsDevicesAndFolders) {
  const TempDir dir;
  const std::string pipe = dir.File("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directory(dir.File("report"));
  for (const std::string& path : {pipe, std::string("/dev/zero"), dir.path().string()}) {
    fs::remove(dir.File("report/matches.csv"));
    fs::create_symlink(path, dir.File("report/matches.csv"));
    for (const Args& args :
         {Args{"info", "--server", "127.0.0.1:1", "--token-file", path},
          Args{"info", "--server", "127.0.0.1:1", "--tls-ca", path},
          Args{"plot", Town().map1, "--answers", path, "--out", dir.File("plot.svg")},
          Args{"publish", Town().map1, "--catalogue", dir.File("catalogue"), "--store",
               dir.File("store"), "--region", "town", "--area", path},
          Args{"report-diff", dir.File("report"), dir.File("report")}}) {
      ExpectOneLine(Scanloc(args), path == dir.path() ? "it is a folder" : "not a regular file");
    }
    const ProcessResult served = RunProcess({kScanlocd, "--config", path});
    EXPECT_EQ(served.status, 2);
    EXPECT_NE(served.err.find("--config: cannot read '" + path), std::string::npos) << served.err;
  }
}

TEST(BadInput, FixesMustBeOfTheDrive) {
  const TempDir dir;
  const std::string columns = "stamp,latitude,longitude,altitude\n";
  const std::string out = dir.File("out.scanloc");
  for (const auto& [text, part] :
       {std::pair(std::string("time,lat\n1,48\n"), "its first line names no column stamp"),
        {columns + "1,48,11,500\n2,48,x,500\n", ":3: does not hold stamp"},
        {columns, "holds no fix"},
        {columns + "1,48,11,500\n2,48,11,500\n",
         "there are 0 fixes at the times of places; at least 5 are needed"}}) {
    ExpectOneLine(Scanloc({"edit", Town().map1, out, "--geo-fixes", dir.Write("fixes.csv", text)}),
                  part);
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST(BadInput, PlotRefusesAnswersThatAreNotOfTheMap) {
  const TempDir dir;
  const std::string header = "query,outcome,place,x,y\n";
  const auto plot = [&](const std::string& csv, const Args& more = {}) {
    Args args = {"plot", Town().map1, "--answers", dir.Write("a.csv", csv), "--out", dir.File("p")};
    args.insert(args.end(), more.begin(), more.end());
    return Scanloc(args);
  };
  ExpectOneLine(plot(""), "a.csv");
  ExpectOneLine(plot("query,other\n1,2\n"), "\"outcome\"");
  ExpectOneLine(plot(header + "s.bin,localized,30,0,0\n"), "30 places");
  ExpectOneLine(plot(header + "s.bin,localized,1,left,0\n"), "left");
  ExpectOneLine(plot(header + "s.bin,localized,1,0\n"), "line 2");
  ExpectOneLine(plot(header + "s.bin,localized,1,0,0\n", {"--truth", Town().Poses1()}), "30 poses");
  EXPECT_FALSE(fs::exists(dir.File("p")));
  EXPECT_EQ(plot(header).status, 0) << "no answers are a picture of the map";
}

}  // namespace
}  // namespace scanloc::test
