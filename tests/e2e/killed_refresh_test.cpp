// `scanloc refresh` killed or stopped at any moment: the input stays as it was, and the output is
// there whole or not at all.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

#include "e2e/programs.hpp"
#include "support/long_tests.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A town, and a drive that sees a part of it rebuilt.
class KilledRefresh : public testing::Test {
 protected:
  void SetUp() override {
    for (const Args& more : {Args{old_}, Args{new_, "--session-seed", "2", "--lane-shift-m", "1",
                                              "--rebuilt-share", "0.5"}}) {
      Args args = {"simulate"};
      args.insert(args.end(), more.begin(), more.end());
      args.insert(args.end(), {"--town-seed", "3", "--length-m", "240", "--rays", "24",
                               "--azimuths", "512", "--spacing-m", "3", "--quiet"});
      MustScanloc(args);
    }
    MustScanloc({"build", in_, "--scans", old_, "--poses", old_ + "/poses.txt", "--quiet",
                 "--no-calibrate"});
    before_ = ReadFile(in_);
  }

  [[nodiscard]] Args Refresh() const {
    return {"refresh", in_, out_, "--scans", new_, "--poses", new_ + "/poses.txt", "--quiet"};
  }
  [[nodiscard]] int NumLeft(const char* of) const {
    int num = 0;
    for (const auto& entry : fs::directory_iterator(dir_.File(""))) {
      num += entry.path().string().find(of) == std::string::npos ? 0 : 1;
    }
    return num;
  }

  const TempDir dir_;
  const std::string old_ = dir_.File("old");
  const std::string new_ = dir_.File("new");
  const std::string in_ = dir_.File("in");
  const std::string out_ = dir_.File("out");
  std::string before_;
};

TEST_F(KilledRefresh, LeavesAWholeMapOrNone) {
  const Clock::time_point start = Clock::now();
  MustScanloc(Refresh());
  const Clock::duration whole = Clock::now() - start;
  ASSERT_TRUE(fs::exists(out_)) << "nothing was seen to be rebuilt";
  const std::string content_id = ContentId(out_);
  EXPECT_EQ(NumLeft(".fresh-") + NumLeft(".partial-"), 0);
  fs::remove(out_);
  std::mt19937 random(5);
  int num_none = 0;
  for (int i = 0; i < (LongTests() ? 60 : 8); ++i) {
    SCOPED_TRACE(i);
    Process refresh(Command(kScanloc, Refresh()), {.merge_stderr = true});
    std::this_thread::sleep_for(whole * static_cast<int>(random() % 1000) / 1000);  // any moment
    refresh.Signal(SIGKILL);
    refresh.Wait();
    EXPECT_EQ(ReadFile(in_), before_) << "the input was changed";
    num_none += fs::exists(out_) ? 0 : 1;
    if (!fs::exists(out_)) continue;
    EXPECT_EQ(Scanloc({"verify", out_}).status, 0);
    EXPECT_EQ(ContentId(out_), content_id);
    fs::remove(out_);
  }
  EXPECT_GT(num_none, 0) << "no moment was before the end";
  // What is left of a process of the same number, as in a container, hinders nobody.
  Args command = {"/bin/sh",
                  "-c",
                  "for left in fresh partial; do echo x > \"$OUT.$left-$$\"; "
                  "echo x > \"$OUT.$left-$$-journal\"; done; exec \"$@\"",
                  "sh",
                  "/usr/bin/env",
                  kScanloc};
  command[2] = "OUT='" + out_ + "'; " + command[2];
  const Args refresh = Refresh();
  command.insert(command.end(), refresh.begin(), refresh.end());
  const ProcessResult after = RunProcess(command);
  EXPECT_EQ(after.status, 0) << after.err;
  EXPECT_EQ(ContentId(out_), content_id);
}

TEST_F(KilledRefresh, CleansUpWhenItIsStopped) {
  Process refresh(Command(kScanloc, Refresh()), {.merge_stderr = true});
  while (NumLeft(".fresh-") == 0 && !fs::exists(out_)) std::this_thread::yield();
  refresh.Signal(SIGTERM);
  EXPECT_GE(refresh.Wait(), 0) << "it ended by itself";
  EXPECT_EQ(NumLeft(".fresh-") + NumLeft(".partial-"), 0);
  EXPECT_TRUE(!fs::exists(out_) || Scanloc({"verify", out_}).status == 0);
  EXPECT_EQ(ReadFile(in_), before_);
}

}  // namespace
}  // namespace scanloc::test
