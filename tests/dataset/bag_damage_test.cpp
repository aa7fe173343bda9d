// Bags that others' writers wrote (tests/data/bags/make_bags.py), with bytes changed afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "support/paths.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::BagPath;
using test::ReadFile;
using test::TempDir;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

using Messages = std::multiset<std::pair<std::string, std::string>>;  // topic, bytes

Messages ReadAll(const Bag& bag, BagDamage& damage) {
  std::vector<const BagTopic*> topics;
  for (const BagTopic& topic : bag.topics()) topics.push_back(&topic);
  Messages messages;
  const absl::Status status = bag.ForEach(
      topics,
      [&](const BagMessage& message) {
        messages.emplace(message.topic->name, message.bytes);
        return absl::OkStatus();
      },
      &damage);
  EXPECT_TRUE(status.ok()) << status;
  return messages;
}

// A file of which every message has a checksum, with any one byte changed.
TEST(DamagedBag, GivesWhatWasWrittenAndSaysWhatIsMissing) {
  constexpr std::uint32_t kSeed = 11;
  const TempDir dir;
  std::mt19937 random(kSeed);
  for (const std::string name : {"zstd.mcap", "lz4.mcap", "plain.mcap", "unindexed.mcap",
                                 "unchunked_checksum.mcap", "drive2.mcap"}) {
    const std::string whole = ReadFile(BagPath(name));
    BagDamage none;
    const Messages written = ReadAll(*Bag::Open({BagPath(name)}).value(), none);
    ASSERT_FALSE(written.empty());
    std::size_t num_opened = 0;
    for (int i = 0; i < 60; ++i) {
      const std::size_t at = random() % whole.size();
      SCOPED_TRACE(absl::StrCat(name, ", seed ", kSeed, ", byte ", at));
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ (1U << random() % 8));
      const auto bag = Bag::Open({dir.Write("damaged.mcap", damaged)});
      if (!bag.ok()) continue;
      ++num_opened;
      BagDamage damage;
      const Messages read = ReadAll(**bag, damage);
      EXPECT_TRUE(std::ranges::includes(written, read));
      if (read.size() < written.size()) {
        EXPECT_FALSE(damage.empty() && (*bag)->notes().empty());
      }
    }
    EXPECT_TRUE(name == "unchunked_checksum.mcap" || num_opened > 40) << name;
  }
}

TEST(DamagedBag, GivesADriveOfWhatIsLeft) {
  const TempDir dir;
  std::string bytes = ReadFile(BagPath("plain.mcap"));
  const auto whole = OpenBagDrive({.paths = {BagPath("plain.mcap")}, .poses_from = "/odom"});
  ASSERT_TRUE(whole.ok()) << whole.status();
  // Within the last cloud: half of the file is the chunks, in their order.
  const std::size_t cloud = bytes.rfind("velodyne", bytes.size() * 3 / 4);
  ASSERT_NE(cloud, std::string::npos);
  bytes[cloud + 200] = static_cast<char>(bytes[cloud + 200] ^ 1);
  const auto drive =
      OpenBagDrive({.paths = {dir.Write("damaged.mcap", bytes)}, .poses_from = "/odom"});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_LT(drive->frames.size(), whole->frames.size());
  EXPECT_THAT(drive->notes,
              Contains(AllOf(HasSubstr("of \"/points\" cannot be read and are left out"),
                             HasSubstr("damaged.mcap: chunk at "), HasSubstr("checksum"))));
}

TEST(DamagedBag, IsRefusedWhereNoCloudIsLeft) {
  const TempDir dir;
  std::string bytes = ReadFile(BagPath("plain.mcap"));
  for (std::size_t at = 0; (at = bytes.find("velodyne", at)) != std::string::npos; ++at) {
    bytes[at] = 'w';
  }
  const auto drive = OpenBagDrive({.paths = {dir.Write("a.mcap", bytes)}, .poses_from = "/odom"});
  EXPECT_EQ(drive.status().code(), absl::StatusCode::kDataLoss) << drive.status();
  EXPECT_THAT(std::string(drive.status().message()),
              AllOf(HasSubstr("no cloud is left: "), Not(HasSubstr("noticed before"))))
      << "and said once";
}

TEST(DamagedBag, LeavesOutAMessageThatIsNone) {
  const TempDir dir;
  const std::string whole = ReadFile(BagPath("unchunked.mcap"));
  const std::size_t frame = whole.rfind("velodyne");  // of the last cloud
  for (const auto& [before_frame, byte, reason] : std::vector<std::tuple<int, char, std::string>>{
           {16, 7, "is not in CDR"}, {9, '\xff', "its stamp, -"}}) {
    std::string bytes = whole;
    bytes[frame - before_frame] = byte;
    const auto drive =
        OpenBagDrive({.paths = {dir.Write("damaged.mcap", bytes)}, .poses_from = "/odom"});
    ASSERT_TRUE(drive.ok()) << drive.status();
    EXPECT_EQ(drive->frames.size(), 6U);
    EXPECT_THAT(drive->notes, Contains(AllOf(HasSubstr("1 message of \"/points\" cannot be read"),
                                             HasSubstr(reason))));
  }
}

TEST(DamagedBag, SaysInANoteWhatIsWrong) {
  const TempDir dir;
  const std::string mcap = ReadFile(BagPath("zstd.mcap"));
  const std::string ros1 = ReadFile(BagPath("ros1.bag"));
  const std::string database = ReadFile(BagPath("ros2_file_zstd/ros2_file_zstd.db3.zstd"));
  struct Case {
    std::string name, bytes;
    std::size_t at;  // of the byte that is changed
    std::string note;
    std::size_t num_readable;
  };
  constexpr std::size_t kAll = 56;
  for (Case& damaged : std::vector<Case>{
           // A name in the summary.
           {"a.mcap", mcap, mcap.rfind("/tf_static") + 1, "the summary there is not used", kAll},
           // The opcode of the first chunk, so that it is none.
           {"b.mcap", mcap, mcap.find("zstd") - 41, "messages that it tells of there are", 40},
           {"c.bag", ros1, ros1.rfind(std::string("op=\5", 4)) + 3, "of the 1 chunks", 0},
           // A frame more, of nonsense.
           {"d.db3.zstd", database + "\x28\xB5\x2F\xFD and no more", 99'999, "is damaged", kAll}}) {
    SCOPED_TRACE(damaged.name);
    if (damaged.at < damaged.bytes.size()) {
      damaged.bytes[damaged.at] = static_cast<char>(damaged.bytes[damaged.at] ^ 0x70);
    }
    const auto bag = Bag::Open({dir.Write(damaged.name, damaged.bytes)});
    ASSERT_TRUE(bag.ok()) << bag.status();
    BagDamage lost;
    EXPECT_GE(ReadAll(**bag, lost).size(), damaged.num_readable);
    EXPECT_THAT((*bag)->notes(), Contains(HasSubstr(damaged.note)));
  }
}

TEST(DamagedBag, OfRosbag2IsReadAsFarAsItsDatabaseGoes) {
  const TempDir dir;
  const std::string whole = ReadFile(BagPath("ros2/ros2.db3"));
  for (const int percent : {75, 80, 90}) {
    SCOPED_TRACE(percent);
    const auto bag =
        Bag::Open({dir.Write("cut.db3", whole.substr(0, whole.size() * percent / 100))});
    ASSERT_TRUE(bag.ok()) << bag.status();
    EXPECT_THAT((*bag)->notes(), Contains(HasSubstr("cut off")));
    BagDamage damage;
    EXPECT_GE(ReadAll(**bag, damage).size(), percent / 4);
  }
}

TEST(DamagedBag, OfRosbag2SaysThatItDoesNotNameATopic) {
  const TempDir dir;
  const std::string path = dir.Write("a.db3", ReadFile(BagPath("ros2/ros2.db3")));
  test::Sql(path, "DELETE FROM topics WHERE name = '/points'");
  EXPECT_THAT(Bag::Open({path}).value()->notes(),
              Contains(HasSubstr("of 7 messages it does not name the topic")));
}

TEST(DamagedBag, SaysThatItIsCutOffWhereThatLeavesNoCloudEither) {
  const TempDir dir;
  const std::string whole = ReadFile(BagPath("ros1_bz2.bag"));
  const std::string cut = dir.Write("cut.bag", whole.substr(0, whole.size() / 10));
  std::vector<std::string> notes;
  for (const absl::Status& status :
       {OpenBagDrive({.paths = {cut}}).status(), ListBagScans({.paths = {cut}}, notes).status()}) {
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("no topic of point clouds"), HasSubstr("cut off")));
  }
}

}  // namespace
}  // namespace scanloc::dataset
