// Files that are taken up anew while the server runs.
#include "ops/file_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/sha.h>

#include <filesystem>
#include <string>
#include <vector>

#include "admission/access.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::server {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FileWatchTest : public testing::Test {
 protected:
  /// Overwrites in place, and sets the time of the change back to what it was.
  void OverwriteInSecret(const std::string& content) {
    const auto written = std::filesystem::last_write_time(path_);
    dir_.Write("file", content);
    std::filesystem::last_write_time(path_, written);
  }

  test::TempDir dir_;
  const std::string path_ = dir_.Write("file", "one");
  std::vector<std::string> taken_;
  int num_troubles_ = 0;
  bool is_refused_ = false;
  FileWatch watch_{{.name = "file",
                    .paths = {path_},
                    .take_up =
                        [this](const FileWatch::Texts& texts) {
                          if (is_refused_) return absl::InvalidArgumentError("bad");
                          taken_.push_back(texts.front());
                          return absl::OkStatus();
                        },
                    .on_trouble = [this] { ++num_troubles_; }}};
};

TEST_F(FileWatchTest, TakesUpWhatIsNewOnceHoweverAlikeTheFileLooks) {
  EXPECT_TRUE(watch_.Look().ok());
  EXPECT_TRUE(watch_.Look().ok());
  OverwriteInSecret("two");
  EXPECT_TRUE(watch_.Look().ok());
  EXPECT_THAT(taken_, ElementsAre("one", "two"));
}

TEST_F(FileWatchTest, OffersAgainWhatWasNotTakenUp) {
  EXPECT_TRUE(watch_.Look().ok());
  OverwriteInSecret("two");
  is_refused_ = true;
  EXPECT_FALSE(watch_.Look().ok());
  is_refused_ = false;
  EXPECT_TRUE(watch_.Look().ok());
  EXPECT_THAT(taken_, ElementsAre("one", "two"));
}

TEST_F(FileWatchTest, TellsATroubleOnceItIsFoundTwice) {
  EXPECT_TRUE(watch_.Look().ok());
  std::filesystem::remove(path_);
  EXPECT_FALSE(watch_.Look().ok());
  EXPECT_EQ(num_troubles_, 0);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(watch_.Look().ok());
  EXPECT_EQ(num_troubles_, 1);
  dir_.Write("file", "one");
  EXPECT_TRUE(watch_.Look().ok());
  EXPECT_THAT(taken_, ElementsAre("one"));
}

TEST_F(FileWatchTest, KnowsForHowLongItDoesNotKnow) {
  const FileWatch::Clock::time_point start{};
  EXPECT_TRUE(watch_.Look(start).ok());
  EXPECT_EQ(watch_.UnknownFor(start + seconds(9)), seconds(0));
  std::filesystem::remove(path_);
  EXPECT_FALSE(watch_.Look(start + seconds(10)).ok());
  EXPECT_FALSE(watch_.Look(start + seconds(20)).ok());
  EXPECT_EQ(watch_.UnknownFor(start + seconds(25)), seconds(15));
  dir_.Write("file", "two");
  EXPECT_TRUE(watch_.Look(start + seconds(30)).ok());
  EXPECT_EQ(watch_.UnknownFor(start + seconds(40)), seconds(0));
}

TEST(Access, AdmitsNobodyOnceItsFileHasBeenUnknownForTooLong) {
  constexpr char kToken[] = "a-token-of-the-fleet-0001";
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(kToken), sizeof kToken - 1,
         reinterpret_cast<unsigned char*>(digest.data()));
  const Caller robot{.name = "fleet", .digest = digest};
  const test::TempDir dir;
  const std::string good = std::string("fleet query ") + kToken + "\n";
  const std::string path = dir.Write("tokens", good);
  const auto access = Access::Create(path);
  ASSERT_TRUE(access.ok()) << access.status();
  const auto now = FileWatch::Clock::now();
  for (const bool is_gone : {true, false}) {
    if (is_gone) {
      std::filesystem::remove(path);
    } else {
      dir.Write("tokens", good + "fleet emperor short\n");
    }
    EXPECT_FALSE((*access)->LookAtFile(now - minutes(4)).ok());
    EXPECT_TRUE((*access)->AdmitAgain(robot, Role::kQuery).ok());
    dir.Write("tokens", good);
    EXPECT_TRUE((*access)->LookAtFile(now - minutes(4)).ok());

    std::filesystem::remove(path);
    EXPECT_FALSE((*access)->LookAtFile(now - minutes(6)).ok());
    EXPECT_EQ((*access)->AdmitAgain(robot, Role::kQuery).code(), absl::StatusCode::kUnavailable);
    dir.Write("tokens", good);
    EXPECT_TRUE((*access)->LookAtFile(now).ok());
    EXPECT_TRUE((*access)->AdmitAgain(robot, Role::kQuery).ok());
  }
}

}  // namespace
}  // namespace scanloc::server
