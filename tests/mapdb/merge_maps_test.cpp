#include "scanloc/mapdb/merge_maps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/process.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::BuildSmallMap;
using testing::HasSubstr;

class MergeMapsTest : public testing::Test {
 protected:
  // A map of one session named like its file.
  std::string Input(const std::string& name, std::size_t num_scans, std::uint32_t seed) {
    const auto summary = BuildSmallMap(dir_.File(name), num_scans, name, seed);
    EXPECT_TRUE(summary.ok()) << summary.status();
    return dir_.File(name);
  }
  void ExpectRefused(const std::vector<std::string>& inputs, absl::StatusCode code,
                     const std::string& message) {
    const absl::Status status = MergeMaps(out_, inputs).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
    EXPECT_FALSE(std::filesystem::exists(out_));
  }

  test::TempDir dir_;
  std::string out_ = dir_.File("out.scanloc");
};

TEST_F(MergeMapsTest, GivesTheMapThatAppendingGives) {
  const auto content_id = MergeMaps(out_, {Input("one", 4, 1), Input("two", 3, 50)});
  ASSERT_TRUE(content_id.ok()) << content_id.status();
  const std::string appended = Input("one.copy", 1, 1);
  std::filesystem::copy_file(dir_.File("one"), appended,
                             std::filesystem::copy_options::overwrite_existing);
  const auto summary = BuildMap(test::SmallOptions(appended, BuildMode::kAppend),
                                test::SmallPlan("two", 3), test::SmallLoader(50));
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(*content_id, summary->content_id);
  const auto merged = LoadMap(out_);
  ASSERT_TRUE(merged.ok()) << merged.status();
  EXPECT_TRUE(test::SameMap(*merged, *LoadMap(appended)));
  EXPECT_TRUE(FindProblems(out_)->empty());
}

TEST_F(MergeMapsTest, RemovesWhatKilledProcessesLeftAnHourAgo) {
  namespace fs = std::filesystem;
  const std::vector<std::string> inputs = {Input("one", 2, 1), Input("two", 2, 50)};
  const std::string young = dir_.Write("out.scanloc.partial-7", "half");
  const std::string own = dir_.Write(absl::StrCat("out.scanloc.fresh-", getpid()), "an input");
  const std::string locked = dir_.Write("out.scanloc.partial-9", "half");
  const std::string other = dir_.Write("out.scanloc-2", "another map");
  const std::vector<std::string> left = {dir_.Write("out.scanloc.partial-8", "half"),
                                         dir_.Write("out.scanloc.partial-8-journal", "half"),
                                         dir_.Write("out.scanloc.fresh-8", "half")};
  for (const auto& entry : fs::directory_iterator(dir_.path())) {
    if (entry.path() != young) {
      fs::last_write_time(entry, fs::file_time_type::clock::now() - std::chrono::hours(2));
    }
  }
  test::Process writer({"/usr/bin/python3", "-c",
                        "import fcntl, signal, sys; f = open(sys.argv[1], 'r+'); fcntl.lockf(f, "
                        "fcntl.LOCK_EX); print('locked', flush=True); signal.pause()",
                        locked});
  ASSERT_EQ(writer.ReadLine(), "locked");
  ASSERT_TRUE(MergeMaps(out_, inputs).ok());
  for (const std::string& path : left) EXPECT_FALSE(fs::exists(path)) << path;
  for (const std::string& path : {young, own, locked, other}) EXPECT_TRUE(fs::exists(path)) << path;
}

TEST_F(MergeMapsTest, NamesSessionsAnewOnRequest) {
  const std::string one = Input("one", 2, 1);
  const std::string two = dir_.File("two");
  ASSERT_TRUE(BuildSmallMap(two, 3, "one", 50).ok());
  ExpectRefused({one, two}, absl::StatusCode::kFailedPrecondition, "--rename-sessions");
  ASSERT_TRUE(MergeMaps(out_, {one, two, one}, /*rename_sessions=*/true).ok());
  EXPECT_THAT(LoadMap(out_)->sessions, testing::ElementsAre("one", "one-2", "one-3"));
  EXPECT_TRUE(FindProblems(out_)->empty());
}

// What is done at the end, as calibration, needs the memory itself.
TEST_F(MergeMapsTest, HoldsNoPlaceOnceAllAreWritten) {
  constexpr std::size_t kNumScans = 300;
  SessionPlan plan = test::SmallPlan("one", kNumScans);
  for (PlannedScan& scan : plan.scans) scan.name.insert(0, 200, 'x');
  ASSERT_TRUE(BuildMap(test::SmallOptions(dir_.File("one")), plan, test::SmallLoader()).ok());
  const std::string one = dir_.File("one");
  const std::size_t before = mallinfo2().uordblks;
  std::size_t at_end = before;
  ASSERT_TRUE(MergeMaps(out_, {one, one}, /*rename_sessions=*/true, {}, [&](const std::string&) {
                at_end = mallinfo2().uordblks;
                return absl::OkStatus();
              }).ok());
  EXPECT_LT(at_end, before + kNumScans * 200);
}

TEST_F(MergeMapsTest, TakesAllSessionsOfAllInputsInTheirOrder) {
  const std::string both = dir_.File("both");
  ASSERT_TRUE(MergeMaps(both, {Input("one", 2, 1), Input("two", 3, 50)}).ok());
  ASSERT_TRUE(MergeMaps(out_, {Input("three", 4, 90), both}).ok());
  const auto map = LoadMap(out_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->sessions, (std::vector<std::string>{"three", "one", "two"}));
  EXPECT_EQ(map->places.size(), 9U);
  EXPECT_EQ(map->places.back().session, 2);
}

TEST_F(MergeMapsTest, LeavesOutSessionsWithoutAPlace) {
  auto empty =
      MapBuilder::Create(dir_.File("empty"), test::SmallParams(), test::SmallPlan("empty", 1));
  ASSERT_TRUE(empty.ok()) << empty.status();
  ASSERT_TRUE(empty->Skip(SkipReason::kEmpty).ok());
  ASSERT_TRUE(empty->Finish().ok());
  ASSERT_TRUE(MergeMaps(out_, {dir_.File("empty"), Input("one", 2, 1)}).ok());
  EXPECT_EQ(LoadMap(out_)->sessions, std::vector<std::string>{"one"});
  std::filesystem::remove(out_);
  ExpectRefused({dir_.File("empty")}, absl::StatusCode::kInvalidArgument, "no place");
}

TEST_F(MergeMapsTest, RefusesAnOutputThatExists) {
  const std::string input = Input("one", 2, 1);
  dir_.Write("out.scanloc", "precious");
  const absl::Status status = MergeMaps(out_, {input}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists) << status;
  EXPECT_EQ(test::ReadFile(out_), "precious");
}

TEST_F(MergeMapsTest, RefusesInputsThatDoNotFit) {
  const std::string one = Input("one", 2, 1);
  BuildOptions options = test::SmallOptions(dir_.File("low"));
  options.params.sensor_height_m = 1.0;
  ASSERT_TRUE(BuildMap(options, test::SmallPlan("low", 2), test::SmallLoader()).ok());
  options = test::SmallOptions(dir_.File("half"));
  {
    ASSERT_TRUE(
        MapBuilder::Create(dir_.File("half"), options.params, test::SmallPlan("half", 2)).ok());
  }

  ExpectRefused({}, absl::StatusCode::kInvalidArgument, "no map");
  ExpectRefused({one, one}, absl::StatusCode::kFailedPrecondition, "session 'one'");
  ExpectRefused({one, dir_.File("low")}, absl::StatusCode::kFailedPrecondition,
                "sensor_height_m is '1', not '2'");
  ExpectRefused({one, dir_.File("half")}, absl::StatusCode::kFailedPrecondition, "incomplete");
  ExpectRefused({one, dir_.File("none")}, absl::StatusCode::kNotFound, "none");
  ExpectRefused({one, dir_.Write("text", "text")}, absl::StatusCode::kInvalidArgument, "text");
}

TEST_F(MergeMapsTest, LeavesNothingBehindWhereAnInputIsDamaged) {
  const std::string one = Input("one", 2, 1);
  const std::string two = Input("two", 2, 50);
  std::string bytes = test::ReadFile(two);
  const std::size_t in_places = bytes.find("000001.bin");
  ASSERT_NE(in_places, std::string::npos);
  bytes[in_places] ^= 1;
  dir_.Write("two", bytes);
  ASSERT_FALSE(LoadMap(two).ok());
  ExpectRefused({one, two}, absl::StatusCode::kDataLoss, two);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir_.path()), {}), 2);
}

}  // namespace
}  // namespace scanloc::mapdb
