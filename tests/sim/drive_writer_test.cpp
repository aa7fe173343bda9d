#include "scanloc/sim/drive_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "support/file_size_limit.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::sim {
namespace {

namespace fs = std::filesystem;
using test::ReadFile;
using test::TempDir;
using ::testing::HasSubstr;

SimulateOptions Small() {
  SimulateOptions options;
  options.town = {5, 60.0};
  options.session.spacing_m = 6.0;
  options.session.tilt_deg = 2.0;
  options.lidar.num_rays = 16;
  options.lidar.num_azimuths = 180;
  return options;
}

/// Every file below the folder with its content, in name order.
std::vector<std::pair<std::string, std::string>> ReadTree(const fs::path& folder) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files.emplace_back(fs::relative(entry.path(), folder).string(), ReadFile(entry.path()));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Rows of poses.txt or odometry.txt, 12 numbers each.
std::vector<std::vector<double>> ReadRows(const fs::path& path) {
  std::istringstream text(ReadFile(path));
  std::vector<std::vector<double>> rows;
  for (double number = 0.0; text >> number;) {
    if (rows.empty() || rows.back().size() == 12) rows.emplace_back();
    rows.back().push_back(number);
  }
  return rows;
}

TEST(DriveWriter, WritesOdometryThatDriftsByAboutThatMuch) {
  const TempDir dir;
  SimulateOptions options = Small();
  options.world.kind = WorldKind::kTunnel;
  options.town.length_m = 200.0;
  ASSERT_TRUE(Simulate(options, dir.path() / "plain", 1).ok());
  EXPECT_FALSE(fs::exists(dir.path() / "plain" / "odometry.txt"));
  double worst_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const fs::path out = dir.path() / std::to_string(seed);
    options.session.session_seed = seed;
    options.session.odometry_noise_percent = 2.0;
    ASSERT_TRUE(Simulate(options, out, 1).ok());
    const auto reckoned = ReadRows(out / "odometry.txt");
    const auto poses = ReadRows(out / "poses.txt");
    ASSERT_EQ(reckoned.size(), poses.size());
    EXPECT_EQ(reckoned[0], (std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));
    const auto travelled = [](const auto& rows) {
      return std::hypot(rows.back()[3] - rows[0][3], rows.back()[7] - rows[0][7],
                        rows.back()[11] - rows[0][11]);
    };
    worst_m = std::max(worst_m, std::abs(travelled(reckoned) - travelled(poses)));
  }
  EXPECT_GT(worst_m, 0.5);
  EXPECT_LT(worst_m, 20.0);
}

TEST(DriveWriter, WritesEveryScanAndPoseOfTheDrive) {
  const TempDir dir;
  const fs::path out = dir.path() / "drive";
  ASSERT_TRUE(Simulate(Small(), out, 1).ok());
  const absl::StatusOr<SimulatedDrive> drive = SimulatedDrive::Create(Small());
  ASSERT_TRUE(drive.ok());

  std::istringstream poses(ReadFile(out / "poses.txt"));
  std::istringstream times(ReadFile(out / "times.txt"));
  for (std::size_t i = 0; i < drive->size(); ++i) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        std::string number;
        poses >> number;
        EXPECT_EQ(std::stod(number), drive->T_map_sensor(i).matrix()(row, column));
      }
    }
    double seconds = -1.0;
    times >> seconds;
    EXPECT_NEAR(seconds, static_cast<double>(drive->stamp_ns(i)) * 1e-9, 1e-9);

    const std::string name = "0000" + std::string(i < 10 ? "0" : "") + std::to_string(i) + ".bin";
    const std::string bytes = ReadFile(out / "velodyne" / name);
    const PointCloud scan = drive->Scan(i);
    ASSERT_EQ(bytes.size(), scan.size() * 16);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      float row[4];
      std::memcpy(row, bytes.data() + 16 * k, sizeof row);
      ASSERT_EQ((Point{row[0], row[1], row[2]}), scan[k]);
      ASSERT_EQ(row[3], 0.0F);
    }
  }
  std::string more;
  EXPECT_FALSE(poses >> more) << "more poses than scans";
  EXPECT_FALSE(times >> more) << "more times than scans";
}

TEST(DriveWriter, TellsTheOptionsBesideTheScans) {
  const TempDir dir;
  SimulateOptions options = Small();
  options.session.lane_shift_m = 3.25;
  options.town.town_seed = 18'446'744'073'709'551'615ULL;
  ASSERT_TRUE(Simulate(options, dir.path(), 1).ok());
  const std::string text = ReadFile(dir.path() / "simulation.txt");
  EXPECT_THAT(text, HasSubstr("town_seed: 18446744073709551615\n"));
  EXPECT_THAT(text, HasSubstr("lane_shift_m: 3.25\n"));
  EXPECT_THAT(text, HasSubstr("num_rays: 16\n"));
}

TEST(DriveWriter, WritesTheSameBytesWithAnyNumberOfThreads) {
  const TempDir dir;
  ASSERT_TRUE(Simulate(Small(), dir.path() / "one", 1).ok());
  ASSERT_TRUE(Simulate(Small(), dir.path() / "two", 2).ok());
  ASSERT_TRUE(Simulate(Small(), dir.path() / "many", 40).ok());
  const auto one = ReadTree(dir.path() / "one");
  EXPECT_GT(one.size(), 10U);
  EXPECT_EQ(one, ReadTree(dir.path() / "two"));
  EXPECT_EQ(one, ReadTree(dir.path() / "many"));
}

TEST(DriveWriter, ReportsHowManyScansAreWritten) {
  const TempDir dir;
  std::vector<std::size_t> done;
  std::size_t total = 0;
  ASSERT_TRUE(Simulate(Small(), dir.path(), 2, [&](std::size_t num_done, std::size_t num_total) {
                done.push_back(num_done);
                total = num_total;
              }).ok());
  ASSERT_FALSE(done.empty());
  EXPECT_EQ(std::adjacent_find(done.begin(), done.end(), std::greater_equal<>()), done.end());
  EXPECT_EQ(done.back(), total);
}

TEST(DriveWriter, RefusesAFolderThatIsNotEmpty) {
  const TempDir dir;
  dir.Write("mine.txt", "precious");
  const absl::Status status = Simulate(Small(), dir.path(), 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(status.message()), HasSubstr(dir.path().string()));
  EXPECT_EQ(ReadTree(dir.path()).size(), 1U);
}

TEST(DriveWriter, RefusesAFileAsFolder) {
  const TempDir dir;
  const fs::path file = dir.Write("file", "precious");
  EXPECT_EQ(Simulate(Small(), file, 1).code(), absl::StatusCode::kAlreadyExists);
  const absl::Status below = Simulate(Small(), file / "out", 1);
  EXPECT_FALSE(below.ok());
  EXPECT_THAT(std::string(below.message()), HasSubstr("cannot write"));
  EXPECT_EQ(ReadFile(file), "precious");
}

TEST(DriveWriter, WritesNothingForBadOptions) {
  const TempDir dir;
  SimulateOptions options = Small();
  options.lidar.num_rays = 1;
  EXPECT_EQ(Simulate(options, dir.path() / "a", 1).code(), absl::StatusCode::kInvalidArgument);
  for (const int num_threads : {0, -1, 257}) {
    const absl::Status status = Simulate(Small(), dir.path() / "a", num_threads);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("num_threads"));
  }
  EXPECT_FALSE(fs::exists(dir.path() / "a"));
}

TEST(DriveWriter, SaysThatTheDiskIsFullAndLeavesNoPoses) {
  const TempDir dir;
  const fs::path out = dir.path() / "drive";
  absl::Status status;
  {
    const test::FileSizeLimit limit(10'000);
    status = Simulate(Small(), out, 2);
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(".bin"));
  EXPECT_FALSE(fs::exists(out / "poses.txt"));
}

}  // namespace
}  // namespace scanloc::sim
