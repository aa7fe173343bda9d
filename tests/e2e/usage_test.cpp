// Exit statuses, help, and what becomes of output that cannot be written.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

TEST(Usage, WrongUsageEndsWithTwoAndOneLine) {
  const TempDir dir;
  const std::string& map = Town().map1;
  const Args build = BuildArgs(dir.File("map"));
  const auto with = [](Args args, const Args& more) {
    args.insert(args.end(), more.begin(), more.end());
    return args;
  };
  const std::vector<Args> wrong = {
      {},
      {"frobnicate"},
      {"--frobnicate"},
      {"info"},
      {"info", map, "--frobnicate"},
      {"info", map, "more"},
      {"build", dir.File("map")},
      with(build, {"--frobnicate"}),
      with(build, {"--spacing-m", "nan"}),
      with(build, {"--spacing-m", "-1"}),
      with(build, {"--voxel-size-m", "0"}),
      with(build, {"--sensor-height-m", "20"}),
      with(build, {"--sensor-height-m", "-0.1"}),
      with(build, {"--polar-sectors", "61"}),
      with(build, {"--descriptors", "xy"}),
      with(build, {"--descriptors", ""}),
      with(build, {"--root-shifts-m", "2,left"}),
      with(build, {"--session", ""}),
      with(build, {"--polar-threshold", ""}),
      with(build, {"--format", "mars"}),
      with(build, {"--every", "0"}),
      with(build, {"--every", "2", "--offset", "2"}),
      with(build, {"--from", "3", "--to", "2"}),
      with(build, {"--from", "-1"}),
      with(build, {"--threads", "-1"}),
      with(build, {"--append", "--voxel-size-m", "0.4"}),
      {"simulate"},
      {"simulate", dir.File("town"), "--rays", "15"},
      {"simulate", dir.File("town"), "--length-m", "nan"},
      {"locate", map},
      {"locate", "--scans", Town().drive1},
      {"locate", map, "--server", "127.0.0.1:1", "--scans", Town().drive1},
      {"locate", map, "--scans", Town().drive1, "--scan", "x.bin"},
      {"locate", map, "--scans", Town().drive1, "--send", "scan"},
      {"locate", map, "--scans", Town().drive1, "--method", "best"},
      {"locate", map, "--scans", Town().drive1, "--threshold", "1.5"},
      {"locate", map, "--scans", Town().drive1, "--top", "0"},
      {"locate", "--server", "127.0.0.1:1", "--tls-ca", "", "--scans", Town().drive1},
      {"locate", map, "--scans", Town().drive1, "--top", "3", "--candidates", "2"},
      {"locate", map, "--scans", Town().drive1, "--json", "--csv", "-"},
      {"locate", map, "--scan", "x.bin", "--truth", Town().Poses1()},
      {"locate", map, "--scans", Town().drive1, "--T-base-sensor", "0,0,1"},
      {"locate", map, "--scans", Town().drive1, "--T-base-sensor", "0,0,1,0,0,nan"},
      {"locate", map, "--scans", Town().drive1, "--T-base-sensor", "0,0,1,0,181,0"},
      {"locate", map, "--scans", Town().drive1, "--min-range-m", "-1"},
      {"locate", map, "--scans", Town().drive1, "--self-box", "1,0,0,0,1,1"},
      {"locate", map, "--scans", Town().drive1, "--prior", "0,0,0"},
      {"locate", map, "--scans", Town().drive1, "--prior", "0,0"},
      {"locate", map, "--scans", Town().drive1, "--prior", "0,zero,5"},
      {"locate", map, "--scans", Town().drive1, "--prior-heights", "3,2"},
      {"locate", map, "--scans", Town().drive1, "--prior-geo", "95,11,300"},
      {"locate", map, "--scans", Town().drive1, "--prior", "0,0,5", "--prior-geo", "48,11,300"},
      with(build, {"--calib", "calib.txt", "--T-base-sensor", "0,0,1,0,0,0"}),
      {"bag"},
      with(build, {"--bag", "x.bag"}),
      with(build, {"--topic", "/points"}),
      {"build", dir.File("map"), "--scans", Town().drive1},
      {"build", dir.File("map"), "--bag", "x.bag", "--poses", Town().Poses1()},
      {"locate", map, "--bag", "x.bag", "--scan", "x.bin"},
      {"eval", map, "--scans", Town().drive1},
      {"merge", dir.File("out")},
      {"export", map, "--format", "pdf"},
      {"plot", map},
  };
  for (const Args& args : wrong) {
    std::string command = "scanloc";
    for (const std::string& arg : args) command += " " + arg;
    SCOPED_TRACE(command);
    const ProcessResult result = Scanloc(args);
    EXPECT_EQ(result.status, 2) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_NE(result.err.find("--help"), std::string::npos) << result.err;
  }
  EXPECT_FALSE(std::filesystem::exists(dir.File("map")));
  EXPECT_FALSE(std::filesystem::exists(dir.File("town")));
}

TEST(Usage, EveryCommandHasHelpWithExamples) {
  for (const char* command :
       {"simulate", "build", "info", "verify", "locate", "plot", "merge", "export", "admin"}) {
    const std::string help = MustScanloc({command, "--help"});
    EXPECT_NE(help.find("Example"), std::string::npos) << command;
    EXPECT_NE(help.find(std::string("  scanloc ") + command), std::string::npos) << command;
    EXPECT_NE(MustScanloc({"--help"}).find(std::string("  ") + command + " "), std::string::npos);
  }
  EXPECT_EQ(MustScanloc({"--version"}).rfind("scanloc ", 0), 0U);
}

TEST(Usage, ProgressIsToldInLinesAndQuietIsQuiet) {
  const TempDir dir;
  Args args = BuildArgs(dir.File("quiet"));
  EXPECT_EQ(Scanloc(args).err, "");
  args = BuildArgs(dir.File("told"));
  args.pop_back();
  const ProcessResult told = Scanloc(args);
  // Trials that end at the same time may be told in one line.
  EXPECT_GT(CountLines(told.err), 10) << told.err;
  EXPECT_LE(CountLines(told.err), 20) << told.err;
  EXPECT_NE(told.err.find("30 of 30 calibration trials (100 %)\n"), std::string::npos) << told.err;
  EXPECT_NE(told.err.find("15 of 30 scans built (50 %)\n"), std::string::npos) << told.err;
}

TEST(Usage, FullDiskIsAnErrorWhereverItStrikes) {
  const Args locate = {"locate", Town().map1, "--scans", Town().drive1, "--quiet"};
  Args to_device = locate;
  to_device.insert(to_device.end(), {"--csv", "/dev/full"});
  for (const Args& args : {to_device, Args{"export", Town().map1, "--out", "/dev/full"}}) {
    const ProcessResult result = Scanloc(args);
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_NE(result.err.find("No space left"), std::string::npos) << result.err;
  }
  for (const Args& args : {locate, Args{"--help"}, Args{"info", Town().map1},
                           Args{"info", Town().map1, "--json"}, Args{"verify", Town().map1}}) {
    const ProcessResult result = Scanloc(args, {.stdout_path = "/dev/full"});
    EXPECT_EQ(result.status, 1) << args.front();
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
  }
}

TEST(Usage, ReaderThatWentAwayIsAnErrorAndNoSignal) {
  Process process(Command(kScanloc, {"locate", Town().map1, "--scans", Town().drive1}));
  process.CloseStdout();
  EXPECT_EQ(process.Wait(), 1) << process.stderr_text();
  EXPECT_NE(process.stderr_text().find("scanloc locate: cannot write to standard output"),
            std::string::npos)
      << process.stderr_text();
}

TEST(Usage, ClosedStdoutIsAnErrorAndNoFileIsTakenForIt) {
  const TempDir dir;
  const std::string map = dir.Write("map", ReadFile(Town().map1));
  EXPECT_EQ(Scanloc({"info", map}, {.close_stdout = true}).status, 1);
  EXPECT_EQ(ReadFile(map), ReadFile(Town().map1));
}

TEST(Usage, CsvReplacesAFileOnlyOnceItIsWhole) {
  const TempDir dir;
  const std::string csv = dir.Write("answers.csv", "old");
  const Args locate = {"locate", Town().map1, "--quiet", "--csv", csv};
  Args failing = locate;
  failing.insert(failing.end(), {"--scan", dir.File("none.bin")});
  EXPECT_EQ(Scanloc(failing).status, 1);
  EXPECT_EQ(ReadFile(csv), "old");
  Args working = locate;
  working.insert(working.end(), {"--scans", Town().drive1});
  MustScanloc(working);
  EXPECT_EQ(CountLines(ReadFile(csv)), TinyTown::kNumScans + 1);
  int num_files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(dir.path())) {
    ++num_files;
  }
  EXPECT_EQ(num_files, 1) << "no temporary file is left";
  ProcessResult no_folder =
      Scanloc({"locate", Town().map1, "--scans", Town().drive1, "--csv", dir.File("no/a.csv")});
  EXPECT_EQ(no_folder.status, 1);
}

TEST(Usage, NoCommandReplacesWhatItReads) {
  const TempDir dir;
  const auto copy = [&](const std::string& from, const char* name) {
    std::filesystem::copy_file(from, dir.File(name));
    return dir.File(name);
  };
  const std::string map = copy(Town().map1, "map");
  const std::string poses = copy(Town().Poses1(), "poses.txt");
  std::filesystem::create_symlink(poses, dir.File("link"));
  const std::string map_before = ReadFile(map);
  const std::string poses_before = ReadFile(poses);
  for (const Args& args : std::vector<Args>{
           {"export", map, "--out", map},
           {"plot", map, "--out", map},
           {"locate", map, "--scans", Town().drive1, "--to", "0", "--csv", map},
           {"optimize", "--scans", Town().drive1, "--poses", poses, "--out", dir.File("link")}}) {
    const ProcessResult result = Scanloc(args);
    EXPECT_EQ(result.status, 2) << result.err;
    EXPECT_NE(result.err.find("choose another name"), std::string::npos) << result.err;
  }
  EXPECT_EQ(ReadFile(map), map_before);
  EXPECT_EQ(ReadFile(poses), poses_before);
}

TEST(Usage, TakesAScanFromStandardInput) {
  const std::string scan = Town().drive2 + "/velodyne/000007.bin";
  const std::string command = kScanloc + " locate " + Town().map1 + " --json --quiet --scan ";
  const ProcessResult file = RunProcess({"/bin/sh", "-c", command + scan});
  const ProcessResult piped = RunProcess({"/bin/sh", "-c", "cat " + scan + " | " + command + "-"});
  ASSERT_EQ(piped.status, 0) << piped.err;
  const auto answers = [](const ProcessResult& told) {
    return nlohmann::json::parse(told.out).at("queries")[0].at("candidates");
  };
  EXPECT_EQ(answers(piped), answers(file));
  const ProcessResult empty = RunProcess({"/bin/sh", "-c", command + "- </dev/null"});
  EXPECT_EQ(empty.status, 1);
  EXPECT_EQ(empty.err, "scanloc locate: standard input: is empty\n");
}

}  // namespace
}  // namespace scanloc::test
