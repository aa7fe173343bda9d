#include "cli/output.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "support/file_size_limit.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::cli {
namespace {

namespace fs = std::filesystem;
using test::ReadFile;
using test::TempDir;

int NumFiles(const TempDir& dir) {
  return static_cast<int>(
      std::distance(fs::directory_iterator(dir.path()), fs::directory_iterator()));
}

TEST(WriteText, ReplacesTheOldFileByAllOfALongOne) {
  const TempDir dir;
  dir.Write("out", "old");
  std::string text;
  for (int i = 0; i < 300'000; ++i) text += std::to_string(i) + "\n";
  ASSERT_TRUE(WriteText(dir.File("out"), text).ok());
  EXPECT_EQ(ReadFile(dir.File("out")), text);
  EXPECT_EQ(NumFiles(dir), 1);
}

TEST(WriteText, LeavesTheOldFileWhereTheNewOneDoesNotFit) {
  const TempDir dir;
  dir.Write("out", "old");
  absl::Status status;
  {
    const test::FileSizeLimit limit(1 << 20);
    status = WriteText(dir.File("out"), std::string(3 << 20, 'x'));
  }
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.message().find(dir.File("out")), std::string::npos) << status;
  EXPECT_EQ(ReadFile(dir.File("out")), "old");
  EXPECT_EQ(NumFiles(dir), 1);
}

TEST(WriteText, WritesThroughALink) {
  const TempDir dir;
  dir.Write("real", "old");
  fs::create_symlink("real", dir.File("link"));
  ASSERT_TRUE(WriteText(dir.File("link"), "new").ok());
  EXPECT_TRUE(fs::is_symlink(dir.File("link")));
  EXPECT_EQ(ReadFile(dir.File("real")), "new");
}

TEST(WriteText, WritesWhereALinkLeadsThoughNothingIsThereYet) {
  const TempDir dir;
  fs::create_directory(dir.File("folder"));
  fs::create_symlink("folder/second", dir.File("first"));
  fs::create_symlink(dir.File("real"), dir.File("folder/second"));
  ASSERT_TRUE(WriteText(dir.File("first"), "new").ok());
  EXPECT_TRUE(fs::is_symlink(dir.File("first")));
  EXPECT_TRUE(fs::is_symlink(dir.File("folder/second")));
  EXPECT_EQ(ReadFile(dir.File("real")), "new");
}

TEST(WriteText, ReplacesNoMapOrScan) {
  const TempDir dir;
  const std::string map = std::string("SQLite format 3") + '\0' + "pages";
  dir.Write("map", map);
  const absl::Status status = WriteText(dir.File("map"), "new");
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists) << status;
  EXPECT_NE(status.message().find(dir.File("map")), std::string::npos) << status;
  EXPECT_EQ(ReadFile(dir.File("map")), map);
  EXPECT_EQ(NumFiles(dir), 1);
}

TEST(WriteText, TellsThatTheDiskIsFull) {
  EXPECT_EQ(WriteText("/dev/full", "text").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(WriteText("/dev/null", "text").ok());
}

TEST(WriteText, NamesThePathThatCannotBeWritten) {
  const TempDir dir;
  EXPECT_EQ(WriteText(dir.File("none/out"), "text").code(), absl::StatusCode::kNotFound);
  const absl::Status folder = WriteText(dir.path().string(), "text");
  EXPECT_EQ(folder.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(folder.message().find(dir.path().string()), std::string::npos);
}

}  // namespace
}  // namespace scanloc::cli
