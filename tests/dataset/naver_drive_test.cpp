// A drive in the layout that the NAVER LABS outdoor sequences are published in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::NaverBytes;
using test::TempDir;
using ::testing::HasSubstr;

// The LiDAR stands 1 m before and 2 m above the vehicle's origin and looks left.
constexpr const char* kCalibration = R"({
  "Intrinsic": {"LCam": {"K": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}},
  "Extrinsic": {"LCam": [], "Lidar": [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1.0]]}
})";
// The vehicle heads along +y of the world, at (100, 200, 30) and then 5 m further.
const std::string kRows =
    "0.0 -1.0 0.0 1.00e+02 1.0 0.0 0.0 2.00e+02 0.0 0.0 1.0 30.0 0.0 0.0 0.0 1.0\n"
    "0.0 -1.0 0.0 1.00e+02 1.0 0.0 0.0 2.05e+02 0.0 0.0 1.0 30.0 0.0 0.0 0.0 1.0\n";

class NaverDriveTest : public ::testing::Test {
 protected:
  NaverDriveTest() {
    dir_.Write("calibration.json", kCalibration);
    dir_.Write("pangyo/train/lidars/poses.txt", kRows);
    dir_.Write("pangyo/train/lidars/timestamps.txt", "4150.729116\n4.150829e+03\n");
    for (const char* name : {"00000.npy", "00001.npy"}) {
      dir_.Write(absl::StrCat("pangyo/train/lidars/", name),
                 NaverBytes({{10.0F, 0.0F, 1.0F}, {0.0F, 0.0F, 0.0F}}));
    }
  }

  [[nodiscard]] absl::StatusOr<Drive> Open(const std::string& folder) const {
    return OpenDrive(
        {.scans_dir = dir_.File(folder), .poses_file = dir_.File("pangyo/train/lidars/poses.txt")});
  }
  [[nodiscard]] absl::StatusOr<Trajectory> ReadRows(const std::string& rows,
                                                    PoseFormat format = PoseFormat::kAuto) const {
    return ReadTrajectory(dir_.Write("pangyo/train/lidars/poses.txt", rows), format);
  }

  TempDir dir_;
};

TEST_F(NaverDriveTest, IsReadWithItsTimesAndCalibration) {
  for (const char* folder : {"pangyo/train/lidars", "pangyo/train", "pangyo"}) {
    SCOPED_TRACE(folder);
    const auto drive = Open(folder);
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), 2U);
    EXPECT_EQ(drive->frames[0].stamp_ns, 4150729116000);
    EXPECT_EQ(drive->frames[1].stamp_ns, 4150829000000);
    const auto scan = ReadScan(drive->frames[1].file());
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_EQ(scan->points.size(), 1U);
    EXPECT_EQ(scan->num_no_return, 1U);
    // 10 m left of the vehicle, which is -x of the world, 1 m before it and 3 m above.
    const Point& p = scan->points[0];
    const Eigen::Vector3d at = drive->frames[1].T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
    EXPECT_TRUE(at.isApprox(Eigen::Vector3d(90.0, 206.0, 33.0), 1e-9)) << at.transpose();
  }
}

TEST_F(NaverDriveTest, TakesMatricesInFourLinesToo) {
  const auto one_line = ReadRows(kRows);
  const auto lines = ReadRows(
      "0 -1 0 100\n1 0 0 200\n0 0 1 30\n0 0 0 1\n0 -1 0 100\n1 0 0 205\n0 0 1 30\n0 0 0 1\n");
  ASSERT_TRUE(one_line.ok()) << one_line.status();
  ASSERT_TRUE(lines.ok()) << lines.status();
  EXPECT_EQ(lines->format, PoseFormat::kNaver);
  EXPECT_TRUE(lines->stamps_ns.empty());
  ASSERT_EQ(lines->T_map_sensor.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(lines->T_map_sensor[i].isApprox(one_line->T_map_sensor[i], 1e-12));
  }
}

TEST_F(NaverDriveTest, RefusesRowsThatAreNoMatrices) {
  const std::string good = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
  ASSERT_TRUE(ReadRows(good).ok());
  for (const auto& [rows, reason] : std::vector<std::pair<std::string, std::string>>{
           {"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\n", "last row"},
           {"1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 nan\n", "last row"},
           {"1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 x\n", "poses.txt:1: \"x\""},
           {"2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n", "rotation"},
           {good + "1 0 0 0\n", "ends within a matrix"},
           {"1 0 0 0\n0 1 0 0\n0 0 1 0\n", "ends within a matrix"},
           {"1 0 0 0\n" + good, "poses.txt:2: has 16 values; 4 are needed"},
           {good + "1 0 0\n", "poses.txt:2: has 3 values; 16 are needed"},
           {good + "\n" + good, "blank line"}}) {
    const auto trajectory = ReadRows(rows);
    EXPECT_EQ(trajectory.status().code(), absl::StatusCode::kInvalidArgument) << rows;
    EXPECT_THAT(std::string(trajectory.status().message()), HasSubstr(reason)) << rows;
  }
  for (std::size_t size = 0; size + 2 < good.size(); ++size) {
    EXPECT_FALSE(ReadRows(good.substr(0, size), PoseFormat::kNaver).ok()) << size;
  }
}

TEST_F(NaverDriveTest, RefusesOtherNumbersOfScansOrTimesAndMissingScans) {
  dir_.Write("pangyo/train/lidars/timestamps.txt", "1\n2\n3\n");
  EXPECT_THAT(std::string(Open("pangyo/train/lidars").status().message()),
              HasSubstr("timestamps.txt: holds 3 times"));
  dir_.Write("pangyo/train/lidars/timestamps.txt", "1\n2\n");
  std::filesystem::remove(dir_.File("pangyo/train/lidars/00001.npy"));
  EXPECT_FALSE(Open("pangyo/train/lidars").ok());
}

TEST_F(NaverDriveTest, NeedsAGoodCalibration) {
  for (const auto& [content, reason] : std::vector<std::pair<std::string, std::string>>{
           {"{", "is not JSON"},
           {"{}", "no entry \"Lidar\""},
           {R"({"Extrinsic": 7})", "no entry \"Lidar\""},
           {R"({"Extrinsic": {"Lidar": [1, 2]}})", "4 rows"},
           {R"({"Extrinsic": {"Lidar": [[1,0,0,0],[0,1,0,0],[0,0,1],[0,0,0,1]]}})", "row 2"},
           {R"({"Extrinsic": {"Lidar": [[1,0,0,0],[0,1,0,"0"],[0,0,1,0],[0,0,0,1]]}})",
            "row 1, column 3"},
           {R"({"Extrinsic": {"Lidar": [[1,0,0,0],[0,1,0,0],[0,0,2,0],[0,0,0,1]]}})", "rotation"},
           {R"({"Extrinsic": {"Lidar": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]}})",
            "last row"}}) {
    dir_.Write("calibration.json", content);
    const auto drive = Open("pangyo/train/lidars");
    EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument) << content;
    EXPECT_THAT(std::string(drive.status().message()), HasSubstr(reason)) << content;
  }
  const std::string whole = kCalibration;
  for (std::size_t size = 0; size + 1 < whole.size(); ++size) {
    const std::string path = dir_.Write("calibration.json", whole.substr(0, size));
    EXPECT_EQ(ReadCalib(path).status().code(), absl::StatusCode::kInvalidArgument) << size;
  }
  std::filesystem::remove(dir_.File("calibration.json"));
  EXPECT_THAT(std::string(Open("pangyo/train/lidars").status().message()), HasSubstr("--calib"));
  const auto given = OpenDrive({.scans_dir = dir_.File("pangyo"),
                                .poses_file = dir_.File("pangyo/train/lidars/poses.txt"),
                                .calib_file = dir_.Write("other.json", kCalibration)});
  EXPECT_TRUE(given.ok()) << given.status();
}

}  // namespace
}  // namespace scanloc::dataset
