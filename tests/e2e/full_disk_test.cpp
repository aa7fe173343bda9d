// `scanloc build` that runs out of room: one line, status 1, and what was committed is there.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

namespace fs = std::filesystem;

constexpr int kNumScans = 60;

class FullDisk : public testing::Test {
 protected:
  [[nodiscard]] Args Build(const std::string& map, const Args& more = {}) const {
    Args args = {"build",
                 map,
                 "--scans",
                 drive_.scans,
                 "--poses",
                 drive_.poses,
                 "--session",
                 "long",
                 "--spacing-m",
                 "0",
                 "--quiet",
                 "--no-calibrate",
                 "--commit-interval",
                 "5"};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }

  void SetUp() override {
    MustScanloc(Build(dir_.File("unbroken")));
    content_id_ = ContentId(dir_.File("unbroken"));
    whole_bytes_ = fs::file_size(dir_.File("unbroken"));
  }

  static void ExpectOneClearLine(const ProcessResult& result) {
    ASSERT_EQ(result.status, 1) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_EQ(result.err.rfind("scanloc build: ", 0), 0U) << result.err;
    EXPECT_NE(result.err.find("make room, then build with --resume"), std::string::npos)
        << result.err;
  }

  const TempDir dir_;
  const LongDrive drive_ = MakeLongDrive(dir_, kNumScans);
  std::string content_id_;
  std::uintmax_t whole_bytes_ = 0;
};

TEST_F(FullDisk, IsToldAtALimitOnTheSizeOfFiles) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the sanitizer writes a file of its own, before main, and dies of the limit";
#endif
  if (!fs::exists("/usr/bin/prlimit")) GTEST_SKIP() << "needs /usr/bin/prlimit";
  int most_places = 0;
  for (int tenths = 0; tenths < 10; ++tenths) {
    SCOPED_TRACE(tenths);
    const std::string map = dir_.File("limited" + std::to_string(tenths));
    const std::string limit = std::to_string(whole_bytes_ * static_cast<unsigned>(tenths) / 10);
    Args command = {"/usr/bin/prlimit", "--fsize=" + limit, kScanloc};
    const Args build = Build(map);
    command.insert(command.end(), build.begin(), build.end());
    ExpectOneClearLine(RunProcess(command));
    most_places = std::max(most_places, NumPlacesCommitted(map));
    MustScanloc(Build(map, {"--resume"}));
    EXPECT_EQ(ContentId(map), content_id_);
  }
  EXPECT_GT(most_places, kNumScans / 2);
}

/// A file system of its own with so many bytes; gone at the end.
class SmallDisk {
 public:
  SmallDisk(std::string path, std::uintmax_t num_bytes) : path_(std::move(path)) {
    fs::create_directory(path_);
    const std::string size = "size=" + std::to_string(num_bytes);
    error_ = mount("scanloc-test", path_.c_str(), "tmpfs", 0, size.c_str()) == 0 ? 0 : errno;
  }
  ~SmallDisk() {
    if (error_ == 0) umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] int error() const { return error_; }
  void Resize(std::uintmax_t num_bytes) const {
    const std::string size = "size=" + std::to_string(num_bytes);
    if (mount("scanloc-test", path_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) != 0) {
      throw std::runtime_error(std::string("cannot make room: ") + std::strerror(errno));
    }
  }

 private:
  std::string path_;
  int error_ = 0;
};

TEST_F(FullDisk, IsToldWhenTheDiskIsFull) {
  const SmallDisk disk(dir_.File("disk"), whole_bytes_ / 2);
  if (disk.error() != 0) GTEST_SKIP() << "cannot mount a tmpfs: " << std::strerror(disk.error());
  const std::string map = dir_.File("disk/map");
  ExpectOneClearLine(Scanloc(Build(map)));
  EXPECT_GT(NumPlacesCommitted(map), 0);
  ExpectOneClearLine(Scanloc(Build(map, {"--resume"})));
  EXPECT_GT(NumPlacesCommitted(map), 0);
  disk.Resize(4 * whole_bytes_);
  MustScanloc(Build(map, {"--resume"}));
  EXPECT_EQ(ContentId(map), content_id_);
}

}  // namespace
}  // namespace scanloc::test
