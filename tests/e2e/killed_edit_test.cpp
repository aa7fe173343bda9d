// `scanloc edit` killed at any moment, or without room: the input stays as it was, and the output
// is there whole or not at all.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>

#include "e2e/programs.hpp"
#include "support/long_tests.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string Bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class KilledEdit : public testing::Test {
 protected:
  void SetUp() override {
    MustScanloc({"build", in_, "--scans", drive_.scans, "--poses", drive_.poses, "--spacing-m", "0",
                 "--quiet", "--no-calibrate"});
    before_ = Bytes(in_);
  }

  [[nodiscard]] Args Edit() const {
    return {"edit",   in_, out_, "--thin", "0.1", "--rename-session", session_ + "=renamed",
            "--quiet"};
  }

  /// Whole, or not there.
  void ExpectWholeOrNone() const {
    EXPECT_EQ(Bytes(in_), before_) << "the input was changed";
    if (!fs::exists(out_)) return;
    const ProcessResult verified = Scanloc({"verify", out_});
    EXPECT_EQ(verified.status, 0) << verified.err;
    EXPECT_EQ(ContentId(out_), content_id_);
  }

  const TempDir dir_;
  const LongDrive drive_ = MakeLongDrive(dir_, 40);
  const std::string in_ = dir_.File("in");
  const std::string out_ = dir_.File("out");
  const std::string session_ = fs::path(drive_.scans).filename();
  std::string before_;
  std::string content_id_;
};

TEST_F(KilledEdit, LeavesAWholeMapOrNone) {
  const Clock::time_point start = Clock::now();
  MustScanloc(Edit());
  const Clock::duration whole = Clock::now() - start;
  content_id_ = ContentId(out_);
  fs::remove(out_);
  std::mt19937 random(5);
  int num_none = 0;
  const int num_moments = LongTests() ? 100 : 20;
  for (int i = 0; i < num_moments; ++i) {
    SCOPED_TRACE(i);
    Process edit(Command(kScanloc, Edit()), {.merge_stderr = true});
    std::this_thread::sleep_for(whole * static_cast<int>(random() % 1000) / 1000);  // any moment
    edit.Signal(SIGKILL);
    edit.Wait();
    ExpectWholeOrNone();
    num_none += fs::exists(out_) ? 0 : 1;
    fs::remove(out_);
    // What was left behind hinders nobody.
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(num_none, 0) << "no moment was before the end";
  MustScanloc(Edit());
  ExpectWholeOrNone();
}

TEST_F(KilledEdit, TellsOfADiskWithoutRoom) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the sanitizer writes a file of its own, before main, and dies of the limit";
#endif
  if (!fs::exists("/usr/bin/prlimit")) GTEST_SKIP() << "needs /usr/bin/prlimit";
  for (int tenths = 0; tenths < 10; tenths += 3) {
    SCOPED_TRACE(tenths);
    const auto limit = before_.size() * static_cast<std::size_t>(tenths) / 10;
    Args command = {"/usr/bin/prlimit", "--fsize=" + std::to_string(limit), kScanloc};
    const Args edit = Edit();
    command.insert(command.end(), edit.begin(), edit.end());
    const ProcessResult result = RunProcess(command);
    EXPECT_EQ(result.status, 1) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_FALSE(fs::exists(out_));
    EXPECT_EQ(Bytes(in_), before_);
  }
  for (const auto& entry : fs::directory_iterator(dir_.File(""))) {
    EXPECT_EQ(entry.path().string().find("partial"), std::string::npos) << entry.path();
  }
}

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
    before_ = Bytes(in_);
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
    EXPECT_EQ(Bytes(in_), before_) << "the input was changed";
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
  EXPECT_EQ(Bytes(in_), before_);
}

}  // namespace
}  // namespace scanloc::test
