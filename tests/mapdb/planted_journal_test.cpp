// What may lie beside a map by accident or malice: it is read without being touched, or refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;

constexpr std::string_view kMagic("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);
constexpr std::size_t kSectorBytes = 512;
constexpr std::size_t kPageBytes = 8192;

std::string BigEndian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
  return bytes;
}

// A journal as SQLite writes it (https://www.sqlite.org/fileformat.html): the map had `num_pages`
// pages before, and nothing in them has changed.
std::string Journal(std::uint32_t num_pages, std::uint32_t num_records = 0xffffffff) {
  std::string journal = std::string(kMagic) + BigEndian(num_records) + BigEndian(7) +
                        BigEndian(num_pages) + BigEndian(kSectorBytes) + BigEndian(kPageBytes);
  journal.resize(kSectorBytes, '\0');
  return journal;
}

// Its end if it belongs to a transaction of several files.
std::string SuperJournalName(const std::string& name) {
  std::uint32_t sum = 0;
  for (const char c : name) sum += static_cast<std::uint8_t>(c);
  return BigEndian(0x40000000 / kPageBytes + 1) + name +
         BigEndian(static_cast<std::uint32_t>(name.size())) + BigEndian(sum) + std::string(kMagic);
}

class PlantedJournal : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(test::BuildSmallMap(path_, 5).ok());
    bytes_ = test::ReadFile(path_);
  }
  // Refused by all that reads or writes, and everything is as it was.
  void ExpectRefused(const std::string& message) {
    for (const absl::Status& status :
         {LoadMap(path_).status(), ReadInfo(path_).status(), ReadPlaces(path_).status(),
          FindProblems(path_).status(),
          MapBuilder::Append(path_, test::SmallPlan("two", 1)).status()}) {
      EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
      EXPECT_THAT(std::string(status.message()), HasSubstr(message));
    }
    ExpectUntouched();
  }
  void ExpectNotRecovered() {
    const absl::Status status = RecoverMap(path_).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    ExpectUntouched();
  }
  void ExpectRead() {
    const auto map = LoadMap(path_);
    EXPECT_TRUE(map.ok()) << map.status();
    EXPECT_TRUE(FindProblems(path_).value().empty());
    ExpectUntouched();
  }
  void ExpectUntouched() {
    EXPECT_TRUE(test::ReadFile(path_) == bytes_) << "the map was written";
    struct stat info = {};
    EXPECT_EQ(lstat(journal_.c_str(), &info), 0) << "the journal was removed";
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
  std::string journal_ = path_ + "-journal";
  std::string bytes_;
};

TEST_F(PlantedJournal, ThatCutsTheMapIsNotPlayedBack) {
  dir_.Write("a.scanloc-journal", Journal(2));
  ExpectRefused("--recover");
}

TEST_F(PlantedJournal, ThatNamesAnotherFileDoesNotDeleteIt) {
  const std::string victim = dir_.Write("victim", journal_ + std::string(1, '\0'));
  dir_.Write("a.scanloc-journal", Journal(2) + SuperJournalName(victim));
  ExpectRefused("another file");
  ExpectNotRecovered();
  EXPECT_TRUE(std::filesystem::exists(victim));
}

TEST_F(PlantedJournal, ThatIsNoFileMakesNobodyWait) {
  ASSERT_EQ(mkfifo(journal_.c_str(), 0644), 0);
  ExpectRefused("no file");
  ExpectNotRecovered();
  ASSERT_EQ(unlink(journal_.c_str()), 0);
  ASSERT_EQ(mkdir(journal_.c_str(), 0755), 0);
  ExpectRefused("no file");
  ExpectNotRecovered();
}

TEST_F(PlantedJournal, ThatIsALinkIsNotFollowed) {
  const std::string target = dir_.Write("target", Journal(2));
  std::filesystem::create_symlink(target, journal_);
  ExpectRefused("no file");
  ExpectNotRecovered();
  EXPECT_TRUE(test::ReadFile(target) == Journal(2));
}

TEST_F(PlantedJournal, IsFoundBesideTheFileThatALinkLeadsTo) {
  dir_.Write("a.scanloc-journal", Journal(2));
  const std::string link = dir_.File("current.scanloc");
  std::filesystem::create_symlink(path_, link);
  const absl::Status status = LoadMap(link).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
  std::filesystem::rename(journal_, link + "-journal");
  EXPECT_TRUE(LoadMap(link).ok()) << "it is no journal of this map";
}

TEST_F(PlantedJournal, WithNothingToUndoIsPassedOver) {
  for (const std::string& journal :
       {std::string(), std::string("text"), std::string(5000, 'x'), std::string(kMagic),
        std::string(kSectorBytes, '\0'), Journal(2, 0)}) {
    dir_.Write("a.scanloc-journal", journal);
    ExpectRead();
    EXPECT_EQ(RecoverMap(path_).value(), Recovery::kNothingToDo);
    EXPECT_TRUE(test::ReadFile(journal_) == journal);
  }
}

TEST_F(PlantedJournal, DoesNotCutASoundMapWhenItIsRecovered) {
  dir_.Write("a.scanloc-journal", Journal(2));
  EXPECT_EQ(RecoverMap(path_).value(), Recovery::kJournalRemoved);
  EXPECT_FALSE(std::filesystem::exists(journal_));
  EXPECT_TRUE(test::ReadFile(path_) == bytes_);
}

TEST_F(PlantedJournal, IsNotPlayedBackIntoAFileThatIsNoMap) {
  const std::string text(3 * kPageBytes, 'x');
  const std::string path = dir_.Write("notes.txt", text);
  dir_.Write("notes.txt-journal", Journal(1));
  EXPECT_EQ(RecoverMap(path).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(test::ReadFile(path) == text);
}

TEST_F(PlantedJournal, WriteAheadLogAndSharedMemoryArePassedOver) {
  dir_.Write("a.scanloc-journal", "");
  for (const char* suffix : {"-wal", "-shm"}) {
    ASSERT_EQ(mkfifo((path_ + suffix).c_str(), 0644), 0);
    ExpectRead();
    EXPECT_TRUE(std::filesystem::is_fifo(path_ + suffix));
  }
  EXPECT_TRUE(MapBuilder::Append(path_, test::SmallPlan("two", 1)).ok());
}

}  // namespace
}  // namespace scanloc::mapdb
