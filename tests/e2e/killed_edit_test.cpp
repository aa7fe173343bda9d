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

}  // namespace
}  // namespace scanloc::test
