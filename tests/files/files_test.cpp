#include "scanloc/files/files.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <utility>

#include "support/temp_dir.hpp"

namespace scanloc {
namespace {

using testing::HasSubstr;

class Files : public testing::Test {
 protected:
  const test::TempDir dir_;
};

TEST_F(Files, ReadsRegularFilesOfSomeSizeOnly) {
  EXPECT_EQ(*ReadFile(dir_.Write("some", "one"), 3), "one");
  EXPECT_EQ(*ReadFile(dir_.Write("empty", ""), 3), "");
  ASSERT_EQ(mkfifo(dir_.File("fifo").c_str(), 0600), 0);
  const std::pair<std::string, absl::StatusCode> bad[] = {
      {dir_.File("absent"), absl::StatusCode::kNotFound},
      {dir_.File("fifo"), absl::StatusCode::kInvalidArgument},
      {dir_.Write("large", "four"), absl::StatusCode::kResourceExhausted},
      {dir_.File(""), absl::StatusCode::kInvalidArgument},
      {"/dev/zero", absl::StatusCode::kInvalidArgument}};
  for (const auto& [path, code] : bad) {
    const absl::Status status = ReadFile(path, 3).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("'" + path + "'"));
  }
}

TEST_F(Files, ReadsFilesThatAreLongerThanABlock) {
  std::string text(200'000, 'a');
  text.back() = 'z';
  EXPECT_EQ(*ReadFile(dir_.Write("long", text), 200'000), text);
}

TEST_F(Files, EndsWithTheFirstErrorOfWhoTakesBlocks) {
  int num_taken = 0;
  const absl::Status status = ReadBlocks(dir_.Write("long", std::string(200'000, 'a')), [&](auto) {
    return ++num_taken < 2 ? absl::OkStatus() : absl::CancelledError("enough");
  });
  EXPECT_EQ(status, absl::CancelledError("enough"));
  EXPECT_EQ(num_taken, 2);
}

TEST_F(Files, WritesAllOrTellsWhyNot) {
  const std::string path = dir_.File("new");
  const FileDescriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
  EXPECT_TRUE(WriteAll(file, "text"));
  EXPECT_EQ(*ReadFile(path, 4), "text");
  EXPECT_FALSE(WriteAll(FileDescriptor(open("/dev/full", O_WRONLY | O_CLOEXEC)), "text"));
  EXPECT_EQ(errno, ENOSPC);
}

TEST_F(Files, ClosesAFileOnce) {
  FileDescriptor file = *OpenRegularFile(dir_.Write("some", "one"));
  const int number = file.get();
  {
    const FileDescriptor moved = std::move(file);
    EXPECT_NE(fcntl(number, F_GETFD), -1);
  }
  EXPECT_EQ(fcntl(number, F_GETFD), -1);
  EXPECT_EQ(file.get(), -1);  // NOLINT(bugprone-use-after-move): nothing is left in it
}

}  // namespace
}  // namespace scanloc
