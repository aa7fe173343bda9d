// Builds that are killed or stopped lose nothing that was committed.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;

constexpr int kNumScans = 100;

/// Progress of a build that runs in step with the test is read line by line, a line each tenth:
/// when a line has been read, the build is at most two tenths further.
constexpr ProcessOptions kInStep = {.merge_stderr = true, .in_step = true};

Args With(Args args, const Args& more) {
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

Args BuildLongArgs(const LongDrive& drive, const std::string& map, int commit_interval = 7) {
  return With(
      {"build", map, "--scans", drive.scans, "--poses", drive.poses, "--session", "long"},
      {"--commit-interval", std::to_string(commit_interval), "--spacing-m", "0", "--threads", "2"});
}

bool IsComplete(const std::string& map) {
  return json::parse(MustScanloc({"info", map, "--json"})).at("complete");
}

TEST(InterruptedBuild, EndsInTheSameMapWhereverItWasKilled) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, kNumScans);
  MustScanloc(With(BuildLongArgs(drive, dir.File("unbroken")), {"--quiet"}));
  const std::string expected = ContentId(dir.File("unbroken"));
  for (const char* moment : {"(10 %)", "(40 %)", "(80 %)"}) {
    SCOPED_TRACE(moment);
    const std::string map = dir.File(std::string("killed") + moment);
    Process build(Command(kScanloc, BuildLongArgs(drive, map)), kInStep);
    build.ReadLineWith(moment);
    build.Signal(SIGKILL);
    ASSERT_EQ(build.Wait(), -SIGKILL) << build.rest_of_stdout();
    EXPECT_EQ(Scanloc({"verify", map, "--recover"}).status, 0) << "what was committed is sound";
    MustScanloc(With(BuildLongArgs(drive, map), {"--resume", "--quiet"}));
    EXPECT_TRUE(IsComplete(map));
    EXPECT_EQ(ContentId(map), expected);
  }
}

TEST(InterruptedBuild, ResumesBeforeItsFirstCommit) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, kNumScans);
  const std::string map = dir.File("map");
  const Args args = BuildLongArgs(drive, map, kNumScans + 1);
  Process build(Command(kScanloc, args), kInStep);
  build.ReadLineWith("(10 %)");
  build.Signal(SIGKILL);
  ASSERT_EQ(build.Wait(), -SIGKILL) << build.rest_of_stdout();
  MustScanloc(With(args, {"--resume", "--quiet"}));
  EXPECT_TRUE(IsComplete(map));
}

TEST(InterruptedBuild, StopsCleanlyAtCtrlCAndSaysHowToGoOn) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, kNumScans);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const std::string map = dir.File("stopped" + std::to_string(signal));
    Process build(Command(kScanloc, BuildLongArgs(drive, map)), kInStep);
    build.ReadLineWith("(10 %)");
    build.Signal(signal);
    ASSERT_EQ(build.Wait(), 1) << build.rest_of_stdout();
    const std::string told = build.rest_of_stdout();
    ASSERT_NE(told.find("scanloc build: interrupted"), std::string::npos) << told;
    const std::string line = told.substr(told.find("scanloc build: interrupted"));
    EXPECT_NE(line.find("--resume"), std::string::npos) << line;
    EXPECT_EQ(CountLines(line), 1) << line;
    const json info = json::parse(MustScanloc({"info", map, "--json"}));
    EXPECT_EQ(info.at("complete"), false);
    EXPECT_GE(info.at("num_places"), kNumScans / 10);
    MustScanloc(With(BuildLongArgs(drive, map), {"--resume", "--quiet"}));
    EXPECT_TRUE(IsComplete(map));
  }
}

TEST(InterruptedBuild, CountsNoScanAsUnreadableAtCtrlC) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, kNumScans);
  const std::string map = dir.File("map");
  Process build(Command(kScanloc, With(BuildLongArgs(drive, map), {"--skip-bad-scans"})), kInStep);
  build.ReadLineWith("(10 %)");
  build.Signal(SIGINT);
  EXPECT_EQ(build.Wait(), 1) << build.rest_of_stdout();
  EXPECT_EQ(json::parse(MustScanloc({"info", map, "--json"})).at("num_unreadable"), 0);
}

TEST(InterruptedBuild, ResumesAnAppendedSession) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, kNumScans);
  const std::string map = dir.File("map");
  Args first = BuildArgs(map);
  first.insert(first.end(), {"--polar-sectors", "40"});
  MustScanloc(first);
  const Args append = With(BuildLongArgs(drive, map), {"--append", "--accept-inconsistent"});
  Process build(Command(kScanloc, append), kInStep);
  build.ReadLineWith("(30 %)");
  build.Signal(SIGKILL);
  ASSERT_EQ(build.Wait(), -SIGKILL) << build.rest_of_stdout();
  MustScanloc(With(append, {"--resume", "--quiet"}));
  const json info = json::parse(MustScanloc({"info", map, "--json"}));
  EXPECT_EQ(info.at("complete"), true);
  EXPECT_EQ(info.at("num_places"), TinyTown::kNumScans + kNumScans);
}

TEST(InterruptedBuild, IsNotResumedWithAnotherDrive) {
  const TempDir dir;
  const LongDrive drive = MakeLongDrive(dir, 40);
  MustScanloc(With(BuildLongArgs(drive, dir.File("map")), {"--quiet"}));
  const ProcessResult result =
      Scanloc(With(BuildLongArgs(drive, dir.File("map")), {"--resume", "--every", "2"}));
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
}

}  // namespace
}  // namespace scanloc::test
