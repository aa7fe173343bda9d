// A drive in the layout of the KITTI odometry benchmark, whose poses are those of a camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/drive.hpp"
#include "support/real_data.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::KittiBytes;
using test::SomePoints;
using test::TempDir;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class KittiDriveTest : public ::testing::Test {
 protected:
  KittiDriveTest() {
    for (int i = 0; i < 3; ++i) {
      dir_.Write(absl::StrCat("sequences/00/velodyne/00000", i, ".bin"), KittiBytes(SomePoints(3)));
    }
    calib_ = dir_.Write("sequences/00/calib.txt",
                        "P0: 7 0 6 0 0 7 1 0 0 0 1 0\n"
                        "Tr: 0 -1 0 0 0 0 -1 -0.08 1 0 0 -0.27\n");
    // 5 m forward, 0.1 m up hill; then round a bend to the left.
    poses_ = dir_.Write("poses/00.txt",
                        "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 -0.1 0 0 1 5\n"
                        "0.8 0 -0.6 -1 0 1 0 -0.2 0.6 0 0.8 9\n");
  }

  [[nodiscard]] absl::StatusOr<Drive> Open(const std::string& folder,
                                           const std::string& calib = "") const {
    return OpenDrive({.scans_dir = dir_.File(folder), .poses_file = poses_, .calib_file = calib});
  }

  TempDir dir_;
  std::string calib_;
  std::string poses_;
};

TEST_F(KittiDriveTest, UsesTheCalibrationOfTheSequenceAndSaysSo) {
  const auto expected = Open("sequences/00", calib_);
  ASSERT_TRUE(expected.ok()) << expected.status();
  EXPECT_THAT(expected->notes, IsEmpty());
  for (const char* folder : {"sequences/00", "sequences/00/velodyne"}) {
    SCOPED_TRACE(folder);
    const auto drive = Open(folder);
    ASSERT_TRUE(drive.ok()) << drive.status();
    EXPECT_THAT(drive->notes, ElementsAre(HasSubstr("calib.txt is used")));
    const Eigen::Vector3d at = drive->frames[1].T_map_sensor.translation();
    EXPECT_TRUE(at.isApprox(Eigen::Vector3d(5.0, 0.0, 0.1), 1e-9)) << at.transpose();
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_TRUE(drive->frames[i].T_map_sensor.isApprox(expected->frames[i].T_map_sensor, 1e-12));
    }
  }
}

TEST_F(KittiDriveTest, SaysThatACalibrationIsMissing) {
  std::filesystem::remove(calib_);
  const auto drive = Open("sequences/00");
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(drive->notes, ElementsAre(HasSubstr("--calib")));
  EXPECT_NEAR(drive->frames[1].T_map_sensor.translation().z(), 5.0, 1e-12);
}

TEST_F(KittiDriveTest, PassesOnWhatIsWrongWithTheCalibration) {
  dir_.Write("sequences/00/calib.txt", "Tr: 1\n");
  EXPECT_THAT(std::string(Open("sequences/00").status().message()), HasSubstr("calib.txt:1"));
}

TEST_F(KittiDriveTest, LeavesPosesOfTheSensorAsTheyAre) {
  // Forward, backwards, along a bend, and at a standstill that shakes.
  for (const std::string& rows :
       {std::string("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 5 0 1 0 0 0 0 1 0.3\n"
                    "0 -1 0 5 1 0 0 5 0 0 1 0.5\n"),
        std::string("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 -5 0 1 0 0.1 0 0 1 0.3\n"
                    "1 0 0 -9 0 1 0 0 0 0 1 0\n"),
        std::string("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0.4\n"
                    "1 0 0 0 0 1 0 0 0 0 1 0\n")}) {
    dir_.Write("poses/00.txt", rows);
    const auto drive = Open("sequences/00");
    ASSERT_TRUE(drive.ok()) << drive.status();
    EXPECT_THAT(drive->notes, IsEmpty()) << rows;
    const auto trajectory = ReadTrajectory(poses_);
    EXPECT_TRUE(drive->frames[1].T_map_sensor.isApprox(trajectory.value().T_map_sensor[1], 1e-12));
  }
}

TEST(KittiDriveOnRealData, SensorPosesAreTakenAsSuch) {
  SCANLOC_REAL_DATA_OR_SKIP(root, "kitti-00-first-827m");
  for (const std::string& folder :
       {std::string("/../kitti-00-first-827m"), std::string("/../nclt-2013-01-10"),
        std::string("/../mulran-kaist03-21")}) {
    const auto trajectory = ReadTrajectory(root + folder + "/poses.txt");
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_FALSE(MovesLikeACamera(*trajectory)) << folder;
  }
}

}  // namespace
}  // namespace scanloc::dataset
