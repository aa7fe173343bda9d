// `scanloc merge`, `edit`, `align` and `optimize` killed at any moment, or without room: what they
// read stays as it was, and what they write is there whole or not at all.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include "e2e/programs.hpp"
#include "support/long_tests.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

class KilledWriter : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    for (const std::string& seed : {std::string("1"), std::string("2")}) {
      const std::string drive = DriveOf(seed);
      MustScanloc({"simulate", drive, "--session-seed", seed, "--town-seed", "3", "--length-m",
                   "120", "--rays", "16", "--azimuths", "360", "--spacing-m", "3",
                   "--odometry-noise", "1", "--quiet"});
      MustScanloc({"build", MapOf(seed), "--scans", drive, "--poses", drive + "/poses.txt",
                   "--session", "drive-" + seed, "--quiet", "--no-calibrate"});
    }
    for (const std::string& seed : {std::string("1"), std::string("2")}) {
      for (const std::string& path :
           {MapOf(seed), DriveOf(seed) + "/poses.txt", DriveOf(seed) + "/odometry.txt"}) {
        before_[path] = ReadFile(path);
      }
    }
    const Clock::time_point start = Clock::now();
    MustScanloc(Write());
    whole_ = Clock::now() - start;
    written_ = Written();
    size_ = fs::file_size(out_);
    fs::remove(out_);
  }

  [[nodiscard]] std::string DriveOf(const std::string& seed) const {
    return dir_.File("drive-" + seed);
  }
  [[nodiscard]] std::string MapOf(const std::string& seed) const { return dir_.File("in-" + seed); }

  [[nodiscard]] Args Write() const {
    if (GetParam() == "merge") return {"merge", out_, MapOf("1"), MapOf("2"), "--quiet"};
    if (GetParam() == "edit") {
      return {"edit",   MapOf("1"), out_, "--thin", "0.1", "--rename-session", "drive-1=renamed",
              "--quiet"};
    }
    Args args = {GetParam()};
    if (GetParam() == "align") args.push_back(MapOf("1"));
    for (const std::string& more :
         {std::string("--scans"), DriveOf("2"), std::string("--poses"),
          DriveOf("2") + "/odometry.txt", std::string("--out"), out_, std::string("--quiet")}) {
      args.push_back(more);
    }
    return args;
  }
  /// What the output says.
  [[nodiscard]] std::string Written() const {
    if (GetParam() != "merge" && GetParam() != "edit") return ReadFile(out_);
    const ProcessResult verified = Scanloc({"verify", out_});
    return verified.status == 0 ? ContentId(out_) : verified.err;
  }
  void ExpectWholeOrNone() const {
    for (const auto& [path, bytes] : before_) {
      EXPECT_EQ(ReadFile(path) == bytes, true) << path << " was changed";
    }
    if (!fs::exists(out_)) return;
    EXPECT_EQ(Written(), written_);
  }

  const TempDir dir_;
  const std::string out_ = dir_.File("out");
  std::map<std::string, std::string> before_;  // what each input held
  std::string written_;
  std::uintmax_t size_ = 0;
  Clock::duration whole_{};
};

TEST_P(KilledWriter, LeavesAWholeFileOrNone) {
  std::mt19937 random(5);
  int num_none = 0;
  for (int i = 0; i < (LongTests() ? 100 : 20); ++i) {
    SCOPED_TRACE(i);
    Process writer(Command(kScanloc, Write()), {.merge_stderr = true});
    std::this_thread::sleep_for(whole_ * static_cast<int>(random() % 1000) / 1000);  // any moment
    writer.Signal(SIGKILL);
    writer.Wait();
    ExpectWholeOrNone();
    num_none += fs::exists(out_) ? 0 : 1;
    fs::remove(out_);
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(num_none, 0) << "no moment was before the end";
  MustScanloc(Write());  // what was left behind hinders nobody
  EXPECT_EQ(Written(), written_);
}

TEST_P(KilledWriter, TellsOfADiskWithoutRoom) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the sanitizer writes a file of its own, before main, and dies of the limit";
#endif
  if (!fs::exists("/usr/bin/prlimit")) GTEST_SKIP() << "needs /usr/bin/prlimit";
  for (std::uintmax_t tenths = 0; tenths < 10; tenths += 3) {
    SCOPED_TRACE(tenths);
    Args command = {"/usr/bin/prlimit", "--fsize=" + std::to_string(size_ * tenths / 10), kScanloc};
    const Args write = Write();
    command.insert(command.end(), write.begin(), write.end());
    const ProcessResult result = RunProcess(command);
    EXPECT_EQ(result.status, 1) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_EQ(result.err.find("--resume"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(out_));
    ExpectWholeOrNone();
  }
  for (const auto& entry : fs::directory_iterator(dir_.File(""))) {
    EXPECT_NE(entry.path().string().rfind(out_, 0), 0U) << entry.path() << " was left behind";
  }
}

INSTANTIATE_TEST_SUITE_P(Of, KilledWriter, testing::Values("merge", "edit", "align", "optimize"),
                         [](const auto& command) { return command.param; });

}  // namespace
}  // namespace scanloc::test
