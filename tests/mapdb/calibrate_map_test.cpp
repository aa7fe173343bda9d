#include "scanloc/mapdb/calibrate_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"
#include "support/map_equality.hpp"
#include "support/scenes.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kNumScans = 40;

/// A drive of scenes that have nothing in common, 100 m apart, but for the last, which is the first
/// again.
class CalibrateMapTest : public testing::Test {
 protected:
  [[nodiscard]] static SessionPlan Plan(const std::string& session) {
    SessionPlan plan = test::SmallPlan(session, kNumScans);
    for (int i = 0; i < kNumScans; ++i) {
      plan.scans[static_cast<std::size_t>(i)].T_map_place =
          Pose(Eigen::Translation3d(100.0 * i, 0.0, 0.0));
    }
    return plan;
  }
  static void Build(const std::string& path, BuildMode mode = BuildMode::kCreate,
                    const std::string& session = "one") {
    BuildOptions options = test::SmallOptions(path, mode);
    options.params = Params();
    const auto built = BuildMap(options, Plan(session), [](std::size_t i) {
      return absl::StatusOr<PointCloud>(scenes::PostScan(i % (kNumScans - 1), 60));
    });
    ASSERT_TRUE(built.ok()) << built.status();
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(CalibrateMapTest, WritesTheSameOnAnyNumberOfThreadsAndKeepsTheContent) {
  Build(path_);
  const std::string content_id = ReadInfo(path_)->content_id;
  EXPECT_FALSE(ReadInfo(path_)->calibration.has_value());
  const std::string other = dir_.Write("b.scanloc", test::ReadFile(path_));

  std::size_t last_done = 0;
  std::size_t num_trials = 0;
  const auto summary = CalibrateMap({.path = path_, .num_threads = 3, .progress = [&](auto now) {
                                       EXPECT_GE(now.num_done, last_done);
                                       last_done = now.num_done;
                                       num_trials = now.num_trials;
                                     }});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->was_current);
  EXPECT_EQ(num_trials, std::size_t{kNumScans});
  EXPECT_EQ(last_done, num_trials);
  ASSERT_TRUE(CalibrateMap({.path = other, .num_threads = 1}).ok());

  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_TRUE(test::SameMap(*map, *LoadMap(other)));
  EXPECT_EQ(map->content_id, content_id);
  EXPECT_EQ(map->calibration, summary->calibration);
  EXPECT_EQ(map->confusable.size(), summary->num_confusable);
  ASSERT_FALSE(map->confusable.empty());
  EXPECT_EQ(map->confusable[0].place + map->confusable[0].lookalike, kNumScans - 1);
  EXPECT_EQ(ReadInfo(path_)->confusable, map->confusable);
  EXPECT_THAT(*FindProblems(path_), IsEmpty());
}

TEST_F(CalibrateMapTest, DoesNothingToAMapThatIsCalibrated) {
  Build(path_);
  ASSERT_TRUE(CalibrateMap({.path = path_}).ok());
  const std::string bytes = test::ReadFile(path_);
  const auto again = CalibrateMap({.path = path_, .progress = [](auto) { FAIL(); }});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->was_current);
  EXPECT_EQ(test::ReadFile(path_), bytes);
}

TEST_F(CalibrateMapTest, IsDueAgainWhenTheMapHasGrown) {
  Build(path_);
  ASSERT_TRUE(CalibrateMap({.path = path_}).ok());
  Build(path_, BuildMode::kAppend, "two");
  EXPECT_FALSE(ReadInfo(path_)->calibration.has_value());
  EXPECT_EQ(LoadMap(path_)->calibration, Calibration());
  EXPECT_THAT(*FindProblems(path_), IsEmpty());
  const auto summary = CalibrateMap({.path = path_});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->was_current);
  EXPECT_TRUE(ReadInfo(path_)->calibration.has_value());
}

TEST_F(CalibrateMapTest, LeavesTheFileAsItWasWhenCancelled) {
  Build(path_);
  const std::string bytes = test::ReadFile(path_);
  std::atomic<int> num_asked = 0;
  const auto summary = CalibrateMap(
      {.path = path_, .num_threads = 2, .is_cancelled = [&] { return ++num_asked > 5; }});
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kCancelled) << summary.status();
  EXPECT_EQ(test::ReadFile(path_), bytes);
}

TEST_F(CalibrateMapTest, RefusesWhatCannotBeCalibrated) {
  const auto refuse = [](const std::string& path, absl::StatusCode code, const char* why) {
    const absl::Status status = CalibrateMap({.path = path}).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(why));
  };
  refuse(dir_.File("none"), absl::StatusCode::kNotFound, "none");
  refuse(dir_.Write("text", "text"), absl::StatusCode::kInvalidArgument, "text");

  BuildOptions plain = test::SmallOptions(dir_.File("plain"));
  plain.params.structure.enabled = false;
  ASSERT_TRUE(BuildMap(plain, test::SmallPlan("one", 2), test::SmallLoader()).ok());
  refuse(plain.path, absl::StatusCode::kFailedPrecondition, "--keep-scans");

  auto half = MapBuilder::Create(dir_.File("half"), Params(), Plan("one"));
  ASSERT_TRUE(half.ok() && half->Skip(SkipReason::kEmpty).ok() && half->Commit().ok());
  refuse(dir_.File("half"), absl::StatusCode::kFailedPrecondition, "--resume");

  Build(path_);
  const absl::Status threads = CalibrateMap({.path = path_, .num_threads = 257}).status();
  EXPECT_EQ(threads.code(), absl::StatusCode::kInvalidArgument);
  auto busy = MapBuilder::Append(path_, Plan("two"));
  ASSERT_TRUE(busy.ok());
  EXPECT_FALSE(CalibrateMap({.path = path_}).ok());
}

TEST_F(CalibrateMapTest, OfAMapWithoutPlacesGivesTheDefaults) {
  auto empty = MapBuilder::Create(path_, test::SmallParams(), test::SmallPlan("one", 1));
  ASSERT_TRUE(empty.ok() && empty->Skip(SkipReason::kEmpty).ok() && empty->Finish().ok());
  const auto summary = CalibrateMap({.path = path_});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->calibration, Calibration());
  EXPECT_TRUE(ReadInfo(path_)->calibration.has_value());
}

}  // namespace
}  // namespace scanloc::mapdb
