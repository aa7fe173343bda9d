#include "scanloc/mapdb/build_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <limits>
#include <mutex>
#include <set>

#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::SmallLoader;
using test::SmallOptions;
using test::SmallPlan;
using testing::HasSubstr;

class BuildMapTest : public testing::Test {
 protected:
  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(BuildMapTest, GivesTheSameFileOnAnyNumberOfThreads) {
  std::string bytes;
  std::string content_id;
  for (const int num_threads : {1, 2, 4, 0}) {
    BuildOptions options = SmallOptions(dir_.File(std::to_string(num_threads)));
    options.num_threads = num_threads;
    const auto summary = BuildMap(options, SmallPlan("one", 30), SmallLoader());
    ASSERT_TRUE(summary.ok()) << summary.status();
    if (num_threads == 1) {
      bytes = test::ReadFile(options.path);
      content_id = summary->content_id;
    }
    EXPECT_EQ(summary->content_id, content_id);
    EXPECT_EQ(test::ReadFile(options.path), bytes);
  }
}

TEST_F(BuildMapTest, GivesTheSameContentWithAnyCommitInterval) {
  std::set<std::string> content_ids;
  for (const int interval : {1, 4, 1000}) {
    BuildOptions options = SmallOptions(dir_.File(std::to_string(interval)));
    options.commit_interval = interval;
    const auto summary = BuildMap(options, SmallPlan("one", 10), SmallLoader());
    ASSERT_TRUE(summary.ok()) << summary.status();
    content_ids.insert(summary->content_id);
  }
  EXPECT_EQ(content_ids.size(), 1U);
}

TEST_F(BuildMapTest, GivesAnotherContentIdForAnyOtherInput) {
  SessionPlan other_stamp = SmallPlan("one", 5);
  other_stamp.scans[4].stamp_ns += 1;
  SessionPlan other_pose = SmallPlan("one", 5);
  other_pose.scans[2].T_map_place.translation().y() += 1e-6;
  SessionPlan other_scan_name = SmallPlan("one", 5);
  other_scan_name.scans[0].name = "x.bin";
  BuildOptions other_params = SmallOptions(dir_.File("params"));
  other_params.params.search.polar_threshold = 0.4;

  std::set<std::string> content_ids;
  int num_maps = 0;
  const auto build = [&](BuildOptions options, const SessionPlan& plan, std::uint32_t seed) {
    options.path = dir_.File(std::to_string(num_maps++));
    const auto summary = BuildMap(options, plan, SmallLoader(seed));
    ASSERT_TRUE(summary.ok()) << summary.status();
    content_ids.insert(summary->content_id);
  };
  const BuildOptions options = SmallOptions("");
  build(options, SmallPlan("one", 5), 1);
  build(options, SmallPlan("one", 5), 2);
  build(options, SmallPlan("one", 4), 1);
  build(options, SmallPlan("two", 5), 1);
  build(options, other_stamp, 1);
  build(options, other_pose, 1);
  build(options, other_scan_name, 1);
  build(other_params, SmallPlan("one", 5), 1);
  EXPECT_EQ(content_ids.size(), static_cast<std::size_t>(num_maps));
}

TEST_F(BuildMapTest, LoadsEveryScanOnceAndReportsProgressInOrder) {
  std::mutex mutex;
  std::multiset<std::size_t> loaded;
  std::vector<std::size_t> progress;
  const auto summary = BuildMap(
      SmallOptions(path_), SmallPlan("one", 20),
      [&](std::size_t scan) {
        const std::lock_guard lock(mutex);
        loaded.insert(scan);
        return SmallLoader()(scan);
      },
      [&](const BuildProgress& now) {
        EXPECT_EQ(now.num_scans, 20U);
        progress.push_back(now.num_done);
      });
  ASSERT_TRUE(summary.ok()) << summary.status();
  ASSERT_EQ(loaded.size(), 20U);
  ASSERT_EQ(progress.size(), 20U);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(loaded.count(i), 1U);
    EXPECT_EQ(progress[i], i + 1);
  }
}

TEST_F(BuildMapTest, LoadsNoMoreThanAWindowAhead) {
  std::atomic<std::size_t> num_loaded = 0;
  BuildOptions options = SmallOptions(path_);
  options.num_threads = 1;
  const auto summary = BuildMap(
      options, SmallPlan("one", 60),
      [&](std::size_t scan) {
        ++num_loaded;
        return SmallLoader()(scan);
      },
      [&](const BuildProgress& now) { EXPECT_LE(num_loaded, now.num_done + 8); });
  ASSERT_TRUE(summary.ok()) << summary.status();
}

TEST_F(BuildMapTest, CountsPointsAndScansWithoutAPointInRange) {
  const auto summary = BuildMap(
      SmallOptions(path_), SmallPlan("one", 6), [](std::size_t scan) -> absl::StatusOr<PointCloud> {
        const float nan = std::numeric_limits<float>::quiet_NaN();
        if (scan == 0) return PointCloud();
        if (scan == 2) return PointCloud{{1000.0F, 0.0F, 0.0F}};
        PointCloud points = test::SmallScan(static_cast<std::uint32_t>(scan));
        points.push_back({nan, 0.0F, 0.0F});
        return points;
      });
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->num_places, 4);
  EXPECT_EQ(summary->num_empty, 2);
  EXPECT_EQ(summary->num_unreadable, 0);
  EXPECT_EQ(summary->num_points, 4 * 201 + 1);
  EXPECT_EQ(summary->num_points_not_finite, 4);
  const auto places = ReadPlaces(path_);
  ASSERT_EQ(places->size(), 4U);
  EXPECT_EQ((*places)[0].scan, "000001.bin");
  EXPECT_TRUE(ReadInfo(path_)->complete);
}

TEST_F(BuildMapTest, WritesNothingOfASessionThatShowsNothing) {
  const ScanLoader load = [](std::size_t scan) -> absl::StatusOr<PointCloud> {
    if (scan == 1) return absl::DataLossError("file ends after 3 points");
    return PointCloud{{1000.0F, 0.0F, 0.0F}, {std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}};
  };
  BuildOptions options = SmallOptions(path_);
  options.commit_interval = 1;
  options.skip_unreadable = true;
  const absl::Status status = BuildMap(options, SmallPlan("one", 3), load).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(status.message()),
            "none of the 3 scans of session 'one' makes a place: 2 have no point in range, of 4 "
            "points in all, 2 of them not finite, 1 cannot be read; scan 2 of 3 ('000001.bin'): "
            "file ends after 3 points. Nothing was written");
  options.mode = BuildMode::kResume;  // which creates what is not there
  EXPECT_EQ(BuildMap(options, SmallPlan("one", 3), load).status(), status);
  EXPECT_FALSE(std::filesystem::exists(path_));

  ASSERT_TRUE(test::BuildSmallMap(path_, 4).ok());
  const std::string before = test::ReadFile(path_);
  options.mode = BuildMode::kAppend;
  EXPECT_FALSE(BuildMap(options, SmallPlan("two", 3), load).ok());
  EXPECT_EQ(test::ReadFile(path_), before);
}

// Scan 7 cannot be read.
absl::StatusOr<PointCloud> LoadAllButOne(std::size_t scan) {
  if (scan == 7) return absl::DataLossError("file ends after 3 points");
  return SmallLoader()(scan);
}

TEST_F(BuildMapTest, StopsAtAScanThatCannotBeReadAndKeepsAllBefore) {
  for (const int num_threads : {1, 4}) {
    BuildOptions options = SmallOptions(dir_.File(std::to_string(num_threads)));
    options.num_threads = num_threads;
    options.commit_interval = 100;
    const absl::Status status = BuildMap(options, SmallPlan("one", 20), LoadAllButOne).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(std::string(status.message()),
                HasSubstr("scan 8 of 20 ('000007.bin'): file ends after 3 points"));
    EXPECT_EQ(LoadMap(options.path)->places.size(), 7U);

    options.mode = BuildMode::kResume;
    const auto summary = BuildMap(options, SmallPlan("one", 20), SmallLoader());
    ASSERT_TRUE(summary.ok()) << summary.status();
    EXPECT_EQ(summary->num_places, 13);
    EXPECT_EQ(summary->num_places_in_map, 20);
  }
}

TEST_F(BuildMapTest, CountsScansThatCannotBeReadWhereAsked) {
  BuildOptions options = SmallOptions(path_);
  options.skip_unreadable = true;
  const auto summary = BuildMap(options, SmallPlan("one", 20), LoadAllButOne);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->num_places, 19);
  EXPECT_EQ(summary->num_unreadable, 1);
  EXPECT_THAT(summary->first_unreadable, HasSubstr("'000007.bin'): file ends"));
  EXPECT_EQ(ReadInfo(path_)->num_unreadable, 1);
}

TEST_F(BuildMapTest, StopsWhenCancelledEvenWhereUnreadableScansAreSkipped) {
  BuildOptions options = SmallOptions(path_);
  options.skip_unreadable = true;
  const absl::Status status =
      BuildMap(options, SmallPlan("one", 20), [](std::size_t scan) -> absl::StatusOr<PointCloud> {
        if (scan >= 7) return absl::CancelledError("stopped by the user");
        return SmallLoader()(scan);
      }).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;
  const auto info = ReadInfo(path_);
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->num_places, 7);
  EXPECT_EQ(info->num_unreadable, 0);
}

TEST_F(BuildMapTest, AppendsWithTheParametersOfTheMap) {
  ASSERT_TRUE(test::BuildSmallMap(path_, 4).ok());
  BuildOptions options = SmallOptions(path_, BuildMode::kAppend);
  options.params = Params();
  const auto summary = BuildMap(options, SmallPlan("two", 3), SmallLoader(50));
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->num_places, 3);
  EXPECT_EQ(summary->num_places_in_map, 7);
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->params, test::SmallParams());
  EXPECT_EQ(map->places.size(), 7U);
}

TEST_F(BuildMapTest, DoesNothingWhereAllIsDone) {
  const auto first = test::BuildSmallMap(path_, 4);
  const auto again = BuildMap(SmallOptions(path_, BuildMode::kResume), SmallPlan("one", 4),
                              [](std::size_t) -> absl::StatusOr<PointCloud> {
                                ADD_FAILURE() << "loads a scan";
                                return PointCloud();
                              });
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->content_id, first->content_id);
  EXPECT_EQ(again->num_places, 0);
  EXPECT_EQ(again->num_places_in_map, 4);
}

TEST_F(BuildMapTest, RefusesBadOptions) {
  const auto expect_refused = [&](const BuildOptions& options, const std::string& field) {
    const absl::Status status = BuildMap(options, SmallPlan("one", 2), SmallLoader()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(field));
    EXPECT_FALSE(std::filesystem::exists(path_));
  };
  BuildOptions options = SmallOptions(path_);
  options.num_threads = -1;
  expect_refused(options, "num_threads is -1");
  options.num_threads = 257;
  expect_refused(options, "num_threads is 257");
  options = SmallOptions(path_);
  options.commit_interval = 0;
  expect_refused(options, "commit_interval is 0");
  options = SmallOptions(path_);
  options.params.polar.num_rings = 0;
  expect_refused(options, "polar.num_rings");
  expect_refused(SmallOptions(""), "path");
}

}  // namespace
}  // namespace scanloc::mapdb
