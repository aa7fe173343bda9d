// A drive in the layout that MulRan is published in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::KittiBytes;
using test::TempDir;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MulranDriveTest : public ::testing::Test {
 protected:
  MulranDriveTest() {
    // 10 m ahead of the sensor, which is behind the vehicle.
    const std::string scan = KittiBytes({{10.0F, 0.0F, 0.5F}});
    dir_.Write("KAIST03/sensor_data/Ouster/1567410201745204700.bin", scan);
    dir_.Write("KAIST03/sensor_data/Ouster/1567410201845204700.bin", scan);
    // The vehicle heads along -y of the world. The second row is nearest to the first scan.
    poses_ = dir_.Write("KAIST03/global_pose.csv",
                        "1567410201740000000,0,1,0,353061.5,-1,0,0,4026074.25,0,0,1,20.5\n"
                        "1567410201750000000,0,1,0,353061.5,-1,0,0,4026074.00,0,0,1,20.5\n"
                        "1567410201840000000,0,1,0,353061.5,-1,0,0,4026072.00,0,0,1,20.5\n");
  }

  TempDir dir_;
  std::string poses_;
};

TEST_F(MulranDriveTest, IsReadAsPosesOfTheOuster) {
  for (const char* folder : {"KAIST03", "KAIST03/sensor_data", "KAIST03/sensor_data/Ouster"}) {
    SCOPED_TRACE(folder);
    const auto drive = OpenDrive({.scans_dir = dir_.File(folder), .poses_file = poses_});
    ASSERT_TRUE(drive.ok()) << drive.status();
    EXPECT_THAT(drive->notes, ElementsAre(HasSubstr("mount of its Ouster")));
    ASSERT_EQ(drive->frames.size(), 2U);
    EXPECT_EQ(drive->frames[0].stamp_ns, 1567410201745204700);
    // The row 4.8 ms after the first scan and not that 5.2 ms before it. The mount is 1.7042 m
    // ahead and 0.021 m to the right: -y and -x.
    const Eigen::Vector3d first = drive->frames[0].T_map_sensor.translation();
    EXPECT_NEAR(first.x(), 353061.5 - 0.021, 1e-6);
    EXPECT_NEAR(first.y(), 4026074.0 - 1.7042, 1e-6);
    EXPECT_NEAR(first.z(), 20.5 + 1.8047, 1e-6);
    EXPECT_NEAR(drive->frames[1].T_map_sensor.translation().y(), 4026072.0 - 1.7042, 1e-6);
    // It looks backwards, but for a third of a degree.
    const double yaw_deg = Yaw(drive->frames[0].T_map_sensor) * 180.0 / M_PI;
    EXPECT_NEAR(yaw_deg, -90.0 + 179.6654, 1e-4);
    const auto scan = ReadScan(drive->frames[0].file());
    ASSERT_TRUE(scan.ok()) << scan.status();
    const Point& p = scan->points.at(0);
    const Eigen::Vector3d at = drive->frames[0].T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
    EXPECT_NEAR(at.y(), 4026074.0 - 1.7042 + 10.0, 1e-3);
    EXPECT_NEAR(at.z(), 20.5 + 1.8047 + 0.5, 1e-3);
  }
}

TEST_F(MulranDriveTest, TakesAnotherMountThatIsGiven) {
  const std::string none = dir_.Write("none.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto drive =
      OpenDrive({.scans_dir = dir_.File("KAIST03"), .poses_file = poses_, .calib_file = none});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_NEAR(drive->frames[0].T_map_sensor.translation().y(), 4026074.0, 1e-6);
  EXPECT_NEAR(Yaw(drive->frames[0].T_map_sensor), -M_PI / 2.0, 1e-9);
}

TEST_F(MulranDriveTest, LeavesOutScansWithoutAPoseAndSaysSo) {
  dir_.Write("KAIST03/sensor_data/Ouster/1567410209000000000.bin",
             KittiBytes({{10.0F, 0.0F, 0.5F}}));
  const auto drive = OpenDrive({.scans_dir = dir_.File("KAIST03"), .poses_file = poses_});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_EQ(drive->frames.size(), 2U);
  EXPECT_THAT(drive->notes, ElementsAre(HasSubstr("mulran"), HasSubstr("1 of the 3 scans")));
}

}  // namespace
}  // namespace scanloc::dataset
