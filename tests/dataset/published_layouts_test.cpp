// Drives in the layouts that NCLT and Oxford Radar RobotCar are published in.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/paths.hpp"
#include "support/real_data.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::TempDir;

std::string NcltRow(double x_m, double y_m, double z_m) {
  std::string row;
  for (const double value : {x_m, y_m, z_m}) {
    const auto packed = static_cast<std::uint16_t>(std::lround((value + 100.0) / 0.005));
    row += static_cast<char>(packed & 0xffU);
    row += static_cast<char>(packed >> 8U);
  }
  return row + "\x10\x05";
}

std::string OxfordScan(const std::vector<Point>& points) {
  std::string bytes;
  const auto append = [&](float value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
  };
  for (const Point& p : points) append(p.x);
  for (const Point& p : points) append(p.y);
  for (const Point& p : points) append(p.z);
  for (std::size_t i = 0; i < points.size(); ++i) append(0.5F);
  return bytes;
}

constexpr const char* kInsHeader =
    "timestamp,ins_status,latitude,longitude,altitude,northing,easting,down,utm_zone,"
    "velocity_north,velocity_east,velocity_down,roll,pitch,yaw\n";

std::string InsRow(const std::string& stamp, double north_m, double east_m, double down_m,
                   double yaw_rad, const std::string& status = "INS_SOLUTION_GOOD") {
  return stamp + "," + status + ",51.7,-1.2,112.0," + std::to_string(north_m) + "," +
         std::to_string(east_m) + "," + std::to_string(down_m) + ",30U,0,0,0,0,0," +
         std::to_string(yaw_rad) + "\n";
}

TEST(NcltDrive, IsReadAsXForwardYLeftZUpOfTheSensor) {
  const TempDir dir;
  // A wall 10 m ahead and 2 m to the right, 3 m above the ground: z is down.
  dir.Write("velodyne_sync/1357847247396864.bin",
            NcltRow(10.0, 2.0, -3.0) + NcltRow(5.0, 0.0, 0.0));
  dir.Write("velodyne_sync/1357847248396864.bin", NcltRow(9.0, 2.0, -3.0));
  dir.Write("groundtruth_2013-01-10.csv",
            "1357847240000000,NaN,NaN,NaN,NaN,NaN,NaN\n"
            "1357847247396800, 1.0, 2.0, 0.5, 0.0, 0.0, 1.5707963267948966\n"
            "1357847248396800, 1.0, 3.0, 0.5, 0.0, 0.0, 1.5707963267948966\n");
  for (const std::string& folder : {dir.path().string(), dir.File("velodyne_sync")}) {
    const auto drive =
        OpenDrive({.scans_dir = folder, .poses_file = dir.File("groundtruth_2013-01-10.csv")});
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), 2U);
    const Frame& frame = drive->frames.front();
    EXPECT_EQ(frame.stamp_ns, 1357847247396864000);
    const auto scan = ReadScan(frame.file());
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_EQ(scan->points.size(), 2U);
    EXPECT_NEAR(scan->points[0].x, 9.998, 1e-3);
    EXPECT_NEAR(scan->points[0].y, -2.004, 1e-3);
    EXPECT_NEAR(scan->points[0].z, 3.0 - 0.957, 1e-3);
    EXPECT_NEAR(scan->points[1].z, -0.957, 1e-3) << "the ground lies below the sensor";
    // Heading east, which is -y of a world of x north, y west, z up.
    const Eigen::Vector3d ahead = frame.T_map_sensor.rotation() * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(ahead.y(), -1.0, 1e-9);
    // The point of the wall, in the world: 10 m east and 2 m south of the robot.
    const Point& p = scan->points[0];
    const Eigen::Vector3d wall = frame.T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
    EXPECT_NEAR(wall.x(), 1.0 - 2.0, 1e-3);
    EXPECT_NEAR(wall.y(), -(2.0 + 10.0), 1e-3);
    EXPECT_NEAR(wall.z(), -(0.5 - 3.0), 1e-3);
  }
}

TEST(NcltDrive, RefusesWhatIsNone) {
  const TempDir dir;
  const std::string good = NcltRow(10.0, 2.0, -3.0);
  for (std::size_t length = 0; length < good.size(); ++length) {
    const ScanFile file{dir.Write("velodyne_sync/1.bin", good.substr(0, length)), "1.bin",
                        ScanLayout::kNclt};
    EXPECT_EQ(ReadScan(file).status().code(), absl::StatusCode::kInvalidArgument) << length;
  }
  dir.Write("velodyne_sync/1357847247396864.bin", good);
  for (const std::string& poses :
       {std::string("1357847247396864,1,2,3,0,0\n"), std::string("x,1,2,3,0,0,0\n"),
        std::string("-5,1,2,3,0,0,0\n"), std::string("1357847247396864,1,2,3,0,0,inf\n"),
        std::string("1357847247396864,NaN,2,3,0,0,0\n"), std::string("5,1,2,3,0,0,0\n")}) {
    const auto drive = OpenDrive({.scans_dir = dir.File("velodyne_sync"),
                                  .poses_file = dir.Write("groundtruth.csv", poses),
                                  .format = PoseFormat::kNclt});
    EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument) << poses;
  }
}

TEST(NcltDrive, ReadsAPublishedScan) {
  SCANLOC_REAL_DATA_OR_SKIP(path, "formats/nclt-velodyne-sync.bin");
  const auto scan = ReadScan({path, "scan", ScanLayout::kNclt});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points.size(), 188368U / 8);
  // Around the robot most points lie on the ground, about a metre under the sensor.
  std::size_t num_near = 0;
  std::size_t num_ground = 0;
  for (const Point& p : scan->points) {
    if (std::hypot(p.x, p.y) > 15.0F) continue;
    ++num_near;
    if (std::abs(p.z + 1.0F) < 0.5F) ++num_ground;
  }
  EXPECT_GT(2 * num_ground, num_near);
}

class OxfordDriveTest : public testing::Test {
 protected:
  /// A point 10 m ahead of the vehicle and 1 m to its right, 2 m above its origin, as a sensor
  /// turned by half a turn sees it, z down.
  [[nodiscard]] static std::string SeenBy(double origin_x_m, double origin_y_m, double origin_z_m) {
    // The small tilts of the mounts shift it by some tenths of a metre at this range.
    return OxfordScan(
        {{static_cast<float>(-(10.0 - origin_x_m)), static_cast<float>(-(1.0 - origin_y_m)),
          static_cast<float>(-2.0 - origin_z_m)}});
  }
  void WriteScans() const {
    dir_.Write("velodyne_left/1547120789640420.bin", SeenBy(-0.60072, -0.34077, -0.26837));
    dir_.Write("velodyne_right/1547120789650420.bin", SeenBy(-0.61153, 0.55676, -0.27023));
    dir_.Write("velodyne_left/1547120789740420.bin", SeenBy(-0.60072, -0.34077, -0.26837));
    dir_.Write("velodyne_right/1547120789900420.bin", SeenBy(-0.61153, 0.55676, -0.27023));
  }
  [[nodiscard]] absl::StatusOr<Drive> Open(const std::string& ins) const {
    return OpenDrive({.scans_dir = dir_.path(), .poses_file = dir_.Write("gps/ins.csv", ins)});
  }

  TempDir dir_;
};

TEST_F(OxfordDriveTest, MergesBothSensorsAndLeavesOutScansWithoutPartner) {
  WriteScans();
  const auto drive = Open(kInsHeader + InsRow("1547120789640000", 100.0, 50.0, -7.0, 0.0) +
                          InsRow("1547120789740000", 101.0, 50.0, -7.0, 0.0));
  ASSERT_TRUE(drive.ok()) << drive.status();
  ASSERT_EQ(drive->frames.size(), 1U);
  const auto scan = ReadScan(drive->frames[0].file());
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->points.size(), 2U);
  // The frame is level, as the INS is, and so are the sensors but for some tenths of a degree.
  for (const Point& p : scan->points) {
    EXPECT_NEAR(p.x, 10.606, 0.15);
    EXPECT_NEAR(p.y, -0.892, 0.15);
    EXPECT_NEAR(p.z, 1.731, 0.15);
  }
}

TEST_F(OxfordDriveTest, MovesFromTheInsToTheMiddleOfTheSensors) {
  WriteScans();
  const auto at = [&](double yaw_rad) {
    const auto drive = Open(kInsHeader + InsRow("1547120789640000", 100.0, 50.0, -7.0, yaw_rad));
    return Eigen::Vector3d(drive.value().frames.at(0).T_map_sensor.translation());
  };
  // In the vehicle's frame the INS lies at (-1.7132, 0.1181, 1.1948) and the middle of the sensors
  // at (-0.60613, 0.10800, -0.26930): 1.107 m before it, 0.010 m left of it and 1.464 m above, on
  // axes that are turned by roll, pitch, yaw of (-0.0125, 0.04, 0.005) to those of the INS. That
  // pitch brings it 0.04 * 1.464 m forward; it adds 0.04 * 1.107 m to the height, up being -z.
  const Eigen::Vector3d ahead(1.107 + 0.0586, 0.0, 1.464 - 0.0443);
  const Eigen::Vector3d north = at(0.0) - Eigen::Vector3d(100.0, -50.0, 7.0);
  EXPECT_NEAR(north.x(), ahead.x(), 0.01);
  EXPECT_NEAR(north.y(), ahead.y(), 0.05);
  EXPECT_NEAR(north.z(), ahead.z(), 0.01);
  // Passing the same spot in the opposite direction, the arm points the other way.
  const Eigen::Vector3d south = at(M_PI) - Eigen::Vector3d(100.0, -50.0, 7.0);
  EXPECT_NEAR(south.x(), -north.x(), 1e-5);
  EXPECT_NEAR(south.y(), -north.y(), 1e-5);
  EXPECT_NEAR(south.z(), north.z(), 1e-5);
}

TEST_F(OxfordDriveTest, PutsWhatBothSensorsSeeWhereItIs) {
  // A point 20 m north, 3 m east of an INS that heads north, and 5 m above it: where each sensor
  // sees it by its own mount and that of the INS, written as float32.
  const Eigen::Vector3d target(20.0, 3.0, -5.0);  // in the frame of the INS, z down
  const auto pose = [](double x, double y, double z, double roll, double pitch, double yaw) {
    return Eigen::Isometry3d(Eigen::Translation3d(x, y, z) *
                             Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()));
  };
  const Eigen::Vector3d in_vehicle = pose(-1.7132, 0.1181, 1.1948, -0.0125, 0.04, 0.005) * target;
  const auto seen_by = [&](const Eigen::Isometry3d& mount) {
    const Eigen::Vector3f p = (mount.inverse() * in_vehicle).cast<float>();
    return OxfordScan({{p.x(), p.y(), p.z()}});
  };
  dir_.Write("velodyne_left/1547120789640420.bin",
             seen_by(pose(-0.60072, -0.34077, -0.26837, -0.0053948, -0.041998, -3.1337)));
  dir_.Write("velodyne_right/1547120789650420.bin",
             seen_by(pose(-0.61153, 0.55676, -0.27023, 0.0027052, -0.041999, -3.1357)));
  const auto drive = Open(kInsHeader + InsRow("1547120789640000", 100.0, 50.0, -7.0, 0.0));
  ASSERT_TRUE(drive.ok()) << drive.status();
  const auto scan = ReadScan(drive->frames[0].file());
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->points.size(), 2U);
  for (const Point& p : scan->points) {
    const Eigen::Vector3d found = drive->frames[0].T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
    EXPECT_NEAR(found.x(), 120.0, 1e-4);
    EXPECT_NEAR(found.y(), -53.0, 1e-4);
    EXPECT_NEAR(found.z(), 12.0, 1e-4);
  }
}

TEST_F(OxfordDriveTest, LeavesOutRowsThatTheInsDoesNotVouchFor) {
  WriteScans();
  const std::string bad = InsRow("1547120789640410", 900.0, 50.0, -7.0, 0.0, "INS_SOLUTION_FREE");
  const auto drive =
      Open(kInsHeader + bad + InsRow("1547120789640000", 100.0, 50.0, -7.0, 0.0) + bad);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_LT(drive->frames.at(0).T_map_sensor.translation().x(), 110.0);
  ASSERT_EQ(drive->notes.size(), 2U);
  EXPECT_NE(drive->notes[0].find("negated"), std::string::npos) << drive->notes[0];
  EXPECT_NE(drive->notes[1].find("2 rows"), std::string::npos) << drive->notes[1];

  const auto none = Open(kInsHeader + bad);
  EXPECT_EQ(none.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(none.status().message().find("INS_SOLUTION_GOOD"), absl::string_view::npos);
}

TEST_F(OxfordDriveTest, TurnsAsTheVehicleDoes) {
  WriteScans();
  // Heading east.
  const auto drive = Open(kInsHeader + InsRow("1547120789640000", 0.0, 0.0, 0.0, M_PI / 2.0));
  ASSERT_TRUE(drive.ok()) << drive.status();
  const Eigen::Vector3d ahead = drive->frames[0].T_map_sensor.rotation() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(ahead.y(), -1.0, 1e-6);
}

TEST_F(OxfordDriveTest, RefusesWhatIsNone) {
  WriteScans();
  const std::string row = InsRow("1547120789640000", 100.0, 50.0, -7.0, 0.0);
  for (const std::string& ins :
       {row, std::string(kInsHeader), "timestamp,northing\n" + row, kInsHeader + row + kInsHeader,
        kInsHeader + InsRow("now", 1.0, 2.0, 3.0, 0.0),
        kInsHeader + row.substr(0, row.size() / 2)}) {
    EXPECT_EQ(Open(ins).status().code(), absl::StatusCode::kInvalidArgument) << ins;
  }
  const auto drive = Open(kInsHeader + row);
  ASSERT_TRUE(drive.ok());
  const ScanFile file = drive->frames[0].file();
  const std::string whole = test::ReadFile(file.partner_path);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    dir_.Write("velodyne_right/1547120789650420.bin", whole.substr(0, length));
    EXPECT_EQ(ReadScan(file).status().code(), absl::StatusCode::kInvalidArgument) << length;
  }
  std::filesystem::remove(file.partner_path);
  EXPECT_EQ(ReadScan(file).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(OxfordDriveTest, NeedsScansThatBelongTogether) {
  dir_.Write("velodyne_left/1547120789640420.bin", SeenBy(0, 0, 0));
  dir_.Write("velodyne_right/1547120799640420.bin", SeenBy(0, 0, 0));
  const auto drive = Open(kInsHeader + InsRow("1547120789640000", 1.0, 2.0, 3.0, 0.0));
  EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(drive.status().message().find("velodyne_right"), absl::string_view::npos);
}

}  // namespace
}  // namespace scanloc::dataset
