// Bags that others' writers wrote (tests/data/bags/make_bags.py), whole, cut off and damaged.
#include "scanloc/dataset/bag.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "support/paths.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::BagPath;
using test::ReadFile;
using test::TempDir;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<std::string> kWholeBags = {"ros1.bag",          "ros1_bz2.bag",
                                             "ros1_lz4.bag",      "ros2",
                                             "ros2_file_zstd",    "ros2_mcap",
                                             "zstd.mcap",         "lz4.mcap",
                                             "plain.mcap",        "unindexed.mcap",
                                             "unchunked.mcap",    "unchunked_checksum.mcap",
                                             "ros2_message_zstd", "ros2_mcap_message_zstd"};

absl::StatusOr<std::shared_ptr<const Bag>> Open(const std::string& path) {
  return Bag::Open({path});
}

// Number of messages of each topic that can be read, and whether times rise.
std::map<std::string, std::size_t> CountReadable(const Bag& bag, absl::Status* status = nullptr) {
  std::vector<const BagTopic*> topics;
  for (const BagTopic& topic : bag.topics()) topics.push_back(&topic);
  std::map<std::string, std::size_t> counts;
  std::int64_t last_ns = 0;
  absl::Status result = bag.ForEach(topics, [&](const BagMessage& message) {
    EXPECT_GE(message.log_time_ns, last_ns);
    last_ns = message.log_time_ns;
    EXPECT_FALSE(message.bytes.empty());
    ++counts[message.topic->name];
    return absl::OkStatus();
  });
  if (status != nullptr) {
    *status = result;
  } else {
    EXPECT_TRUE(result.ok()) << result;
  }
  return counts;
}

TEST(Bag, ListsAndReadsEveryTopicOfEveryFormat) {
  for (const std::string& name : kWholeBags) {
    SCOPED_TRACE(name);
    const auto bag = Open(BagPath(name));
    ASSERT_TRUE(bag.ok()) << bag.status();
    EXPECT_THAT((*bag)->notes(), IsEmpty());
    ASSERT_EQ((*bag)->topics().size(), 5U);
    const BagTopic* points = (*bag)->FindTopic("/points");
    ASSERT_NE(points, nullptr);
    EXPECT_EQ(points->type, "sensor_msgs/PointCloud2");
    EXPECT_EQ(points->num_messages, 7U);
    EXPECT_EQ(points->first_ns, 1'700'000'000'000'000'000);
    EXPECT_EQ(points->last_ns, 1'700'000'000'600'000'000);
    EXPECT_EQ((*bag)->FindTopic("/odom")->type, "nav_msgs/Odometry");
    EXPECT_EQ((*bag)->FindTopic("/none"), nullptr);
    const std::map<std::string, std::size_t> expected = {
        {"/odom", 16}, {"/points", 7}, {"/pose", 16}, {"/tf", 16}, {"/tf_static", 1}};
    EXPECT_EQ(CountReadable(**bag), expected);
  }
}

TEST(Bag, GivesSeveralThreadsWhatOneGets) {
  const auto read = [](const Bag& bag) {
    std::vector<const BagTopic*> topics;
    for (const BagTopic& topic : bag.topics()) topics.push_back(&topic);
    std::string bytes;
    EXPECT_TRUE(bag.ForEach(topics,
                            [&](const BagMessage& message) {
                              bytes += message.bytes;
                              return absl::OkStatus();
                            })
                    .ok());
    return bytes;
  };
  for (const std::string name : {"zstd.mcap", "plain.mcap", "ros1_lz4.bag"}) {
    const auto bag = Open(BagPath(name));
    ASSERT_TRUE(bag.ok()) << bag.status();
    std::vector<std::string> got(4);
    std::vector<std::thread> threads;
    for (std::string& bytes : got) threads.emplace_back([&] { bytes = read(**bag); });
    for (std::thread& thread : threads) thread.join();
    EXPECT_THAT(got, testing::Each(read(*Open(BagPath(name)).value()))) << name;
  }
}

TEST(Bag, ReadsSeveralFilesAsOne) {
  const auto bag = Bag::Open({BagPath("zstd.mcap"), BagPath("ros2"), BagPath("lz4.mcap")});
  ASSERT_TRUE(bag.ok()) << bag.status();
  EXPECT_EQ(CountReadable(**bag).at("/points"), 21U);
  const auto mixed = Bag::Open({BagPath("zstd.mcap"), BagPath("ros1.bag")});
  EXPECT_THAT(std::string(mixed.status().message()),
              testing::AllOf(HasSubstr("of ROS 2 in"), HasSubstr("of ROS 1 in")));
}

TEST(Bag, ReadsThePartsOfAFolderInTheOrderOfTheirNumbers) {
  const TempDir dir;
  for (const char* name : {"part_10.mcap", "part_2.mcap"}) {
    dir.Write(name, ReadFile(BagPath("zstd.mcap")));
  }
  dir.Write("metadata.yaml", "x");
  const auto bag = Open(dir.path().string());
  ASSERT_TRUE(bag.ok()) << bag.status();
  EXPECT_EQ((*bag)->FindTopic("/points")->num_messages, 14U);
}

// Of a file that was cut off, every message whose bytes are whole.
TEST(Bag, ReadsWhatComesBeforeTheCut) {
  const TempDir dir;
  for (const std::string name : {"zstd.mcap", "lz4.mcap", "plain.mcap", "unindexed.mcap",
                                 "unchunked.mcap", "ros1.bag", "ros1_bz2.bag", "ros1_lz4.bag"}) {
    const std::string whole = ReadFile(BagPath(name));
    std::size_t last = 0;
    for (std::size_t size = whole.size() / 5; size < whole.size(); size += whole.size() / 37) {
      SCOPED_TRACE(absl::StrCat(name, " cut to ", size, " of ", whole.size()));
      const auto bag = Open(dir.Write(name, whole.substr(0, size)));
      ASSERT_TRUE(bag.ok()) << bag.status();
      std::size_t num_messages = 0;
      for (const auto& [topic, num] : CountReadable(**bag)) num_messages += num;
      EXPECT_GE(num_messages, last);
      last = num_messages;
    }
    EXPECT_GE(last, name == "ros1.bag" ? 40U : 45U) << name;
    const auto half = Open(dir.Write(name, whole.substr(0, whole.size() / 2)));
    ASSERT_TRUE(half.ok()) << half.status();
    EXPECT_THAT((*half)->notes(), testing::Contains(HasSubstr("cut off")));
  }
}

TEST(Bag, SaysThatAWriteAheadLogBesideItIsNotRead) {
  const TempDir dir;
  const std::string path = dir.Write("a.db3", ReadFile(BagPath("ros2/ros2.db3")));
  dir.Write("a.db3-wal", "");
  EXPECT_THAT(Open(path).value()->notes(), IsEmpty());
  dir.Write("a.db3-wal", "frames");
  EXPECT_THAT(Open(path).value()->notes(),
              testing::ElementsAre(HasSubstr("a.db3-wal may hold messages")));
}

TEST(Bag, RefusesWhatIsNoBag) {
  const TempDir dir;
  const std::string mcap = ReadFile(BagPath("zstd.mcap"));
  std::string newer = mcap;
  newer[5] = '1';
  std::filesystem::create_directory(dir.File("empty"));
  ASSERT_EQ(mkfifo(dir.File("pipe.bag").c_str(), 0600), 0);
  for (const auto& [path, reason] : std::vector<std::pair<std::string, std::string>>{
           {dir.Write("none.bag", ""), "is empty"},
           {dir.Write("text.bag", "not a bag\n"), "is no bag"},
           {dir.Write("lfs.mcap", "version https://git-lfs.github.com/spec/v1\n"),
            "`git lfs pull`"},
           {dir.Write("a.bag.gz", "\x1F\x8B\x08\x08 and more"), "`gunzip`"},
           {dir.File("pipe.bag"), "regular file"},
           {dir.File("empty"), "holds no bag"},
           {dir.Write("newer.mcap", newer), "version 0"},
           {dir.Write("old.bag", "#ROSBAG V1.2\n\0\0\0"), "rosbag fix"},
           {dir.Write("a.db3", "SQLite format 3\0 and no more"), "rosbag2"},
           {dir.Write("b.db3.zstd", "\x28\xB5\x2F\xFD and no more"), "0 bytes of it could"}}) {
    const auto bag = Open(path);
    EXPECT_EQ(bag.status().code(), absl::StatusCode::kInvalidArgument) << path;
    EXPECT_THAT(std::string(bag.status().message()), HasSubstr(reason)) << path;
  }
  EXPECT_EQ(Open(dir.File("missing.bag")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(Bag::Open({}).ok());
}

TEST(Bag, SaysThatThereIsNoFolderForTheFileThatWasCompressed) {
  const TempDir dir;
  const std::string bag = BagPath("ros2_file_zstd/ros2_file_zstd.db3.zstd");
  for (const std::string& folder : {dir.Write("file", ""), dir.File("none")}) {
    ASSERT_EQ(setenv("TMPDIR", folder.c_str(), 1), 0);
    EXPECT_THAT(std::string(Open(bag).status().message()), HasSubstr("TMPDIR"));
  }
  unsetenv("TMPDIR");
  EXPECT_TRUE(Open(bag).ok());
}

TEST(Bag, ReadsAFileOfAFolderOnceThatIsThereCompressedToo) {
  const TempDir dir;
  const std::string database = ReadFile(BagPath("ros2/ros2.db3"));
  dir.Write("drive.db3", database);
  dir.Write("drive.db3.zstd", ReadFile(BagPath("ros2_file_zstd/ros2_file_zstd.db3.zstd")));
  const auto bag = Open(dir.File(""));
  ASSERT_TRUE(bag.ok()) << bag.status();
  EXPECT_EQ(CountReadable(**bag), CountReadable(**Open(BagPath("ros2"))));
  EXPECT_THAT((*bag)->notes(),
              ElementsAre(HasSubstr("\"drive.db3.zstd\" is left out, because \"drive.db3\"")));
}

TEST(Bag, SaysThatAFileOfAFolderIsMissing) {
  const TempDir dir;
  const std::string metadata =
      "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n    - a_0.mcap\n"
      "    - a_1.mcap\n    - a_2.mcap\n  message_count: 5\n";
  dir.Write("metadata.yaml", metadata);
  for (const char* name : {"a_0.mcap", "a_2.mcap"}) {
    dir.Write(name, ReadFile(BagPath("zstd.mcap")));
  }
  EXPECT_THAT(Open(dir.path()).value()->notes(),
              ElementsAre(AllOf(HasSubstr("names 3 files, of which 2 are there"),
                                HasSubstr("\"a_1.mcap\" is not"))));
  dir.Write("renamed.mcap", ReadFile(BagPath("zstd.mcap")));
  EXPECT_THAT(Open(dir.path()).value()->notes(), IsEmpty());
}

TEST(Bag, GivesMessagesOrARefusalWhateverHappensToTheFile) {
  constexpr std::uint32_t kSeed = 5;
  const TempDir dir;
  std::mt19937 random(kSeed);
  for (const std::string name :
       {"zstd.mcap", "lz4.mcap", "plain.mcap", "unchunked.mcap", "ros1.bag", "ros1_bz2.bag",
        "ros1_lz4.bag", "ros2/ros2.db3", "ros2_message_zstd/ros2_message_zstd.db3",
        "ros2_file_zstd/ros2_file_zstd.db3.zstd"}) {
    const std::string whole = ReadFile(BagPath(name));
    for (int i = 0; i < 40; ++i) {
      SCOPED_TRACE(absl::StrCat(name, ", seed ", kSeed, ", mutation ", i));
      std::string damaged = whole;
      for (int k = 0; k < 4; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
      const auto bag = Open(dir.Write("damaged", damaged));
      if (!bag.ok()) {
        EXPECT_THAT(bag.status().code(),
                    AnyOf(absl::StatusCode::kInvalidArgument, absl::StatusCode::kDataLoss))
            << bag.status();
        continue;
      }
      std::vector<const BagTopic*> topics;
      for (const BagTopic& topic : (*bag)->topics()) topics.push_back(&topic);
      const absl::Status read =
          (*bag)->ForEach(topics, [](const BagMessage&) { return absl::OkStatus(); });
      EXPECT_THAT(read.code(), AnyOf(absl::StatusCode::kOk, absl::StatusCode::kInvalidArgument,
                                     absl::StatusCode::kDataLoss))
          << read;
    }
  }
}

}  // namespace
}  // namespace scanloc::dataset
