// Drives in bags that others' writers wrote. tests/data/bags/make_bags.py tells what they hold: a
// robot that sees six posts, each at its own time of the sweep.
#include "scanloc/dataset/bag_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "bag/bag_notes.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/paths.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::BagPath;
using test::TempDir;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::array<Eigen::Vector3d, 6> kPosts = {
    {{20, 5, 0}, {20, 5, 3}, {-8, 12, 1}, {3, -30, 2}, {40, 0.5, -1}, {-25, -6, 4}}};

// How far the posts of a scan, moved to the map, are from where they stand, shifted [m].
double WorstError(const Frame& frame, const Eigen::Vector3d& shift_m = Eigen::Vector3d::Zero()) {
  const auto scan = ReadScan(frame.file());
  EXPECT_TRUE(scan.ok()) << scan.status();
  if (!scan.ok() || scan->points.size() != kPosts.size()) {
    ADD_FAILURE() << "not six points";
    return 1e9;
  }
  EXPECT_GE(scan->num_not_finite, 1U);
  double worst_m = 0.0;
  for (std::size_t i = 0; i < kPosts.size(); ++i) {
    const Point& p = scan->points[i];
    const Eigen::Vector3d seen = frame.T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
    worst_m = std::max(worst_m, (seen - shift_m - kPosts[i]).norm());
  }
  return worst_m;
}

TEST(BagDrive, PutsWhatIsSeenWhereItStandsInEveryFormat) {
  for (const std::string name :
       {"ros1.bag", "ros1_bz2.bag", "ros1_lz4.bag", "ros2", "ros2_file_zstd", "ros2_message_zstd",
        "ros2_mcap", "ros2_mcap_message_zstd", "zstd.mcap", "lz4.mcap", "plain.mcap",
        "unindexed.mcap", "unchunked.mcap"}) {
    SCOPED_TRACE(name);
    const auto drive = OpenBagDrive({.paths = {BagPath(name)}, .poses_from = "/odom"});
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), 7U);
    EXPECT_EQ(drive->num_without_pose, 0U);
    EXPECT_EQ(drive->frames[1].stamp_ns, 1'700'000'000'100'000'000);
    EXPECT_EQ(drive->frames[1].name, "1700000000.100000000");
    EXPECT_THAT(drive->notes, Contains(AllOf(HasSubstr("base_link"), HasSubstr("tf_static"))));
    for (const Frame& frame : drive->frames) EXPECT_LT(WorstError(frame), 0.03);
  }
}

TEST(BagDrive, TakesPosesFromOdometryPosesAndTransforms) {
  for (const auto& [poses_from, shift_m] :
       std::vector<std::pair<std::string, Eigen::Vector3d>>{{"/odom", {0, 0, 0}},
                                                            {"/pose", {0, 0, 0}},
                                                            {"tf:odom", {0, 0, 0}},
                                                            {"tf:/map", {100, 50, 0}}}) {
    SCOPED_TRACE(poses_from);
    const auto drive = OpenBagDrive({.paths = {BagPath("zstd.mcap")}, .poses_from = poses_from});
    ASSERT_TRUE(drive.ok()) << drive.status();
    for (const Frame& frame : drive->frames) EXPECT_LT(WorstError(frame, shift_m), 0.03);
  }
}

TEST(BagDrive, TakesPosesOfABodyByTransforms) {
  const Pose mount = Eigen::Translation3d(1, 0, 1.5) *
                     Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  const TempDir dir;
  const std::string bag = dir.Write("a.db3", test::ReadFile(BagPath("ros2/ros2.db3")));
  test::Sql(bag,
            "DELETE FROM messages WHERE topic_id = (SELECT id FROM topics WHERE name = "
            "'/tf_static')");
  const std::string error(
      OpenBagDrive({.paths = {bag}, .poses_from = "tf:odom"}).status().message());
  EXPECT_THAT(error, AllOf(HasSubstr("no transforms connect"), HasSubstr("tf:FRAME:BODY")));
  for (const BagDriveOptions& options : std::vector<BagDriveOptions>{
           {.paths = {bag}, .poses_from = "tf:odom:base_link", .T_body_sensor = mount},
           {.paths = {BagPath("ros2")}, .poses_from = "tf:/odom:/base_link"},
           {.paths = {BagPath("ros2")},
           .poses_from = "tf:odom:velodyne",
           .T_body_sensor = mount}}) {
    const auto drive = OpenBagDrive(options);
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), 7U);
    for (const Frame& frame : drive->frames) EXPECT_LT(WorstError(frame), 0.03);
  }
}

TEST(BagDrive, LeavesTheMotionInWhereItIsAskedTo) {
  const auto drive =
      OpenBagDrive({.paths = {BagPath("zstd.mcap")}, .poses_from = "/odom", .deskew = false});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_GT(WorstError(drive->frames[2]), 0.4) << "half a metre in 50 ms at 10 m/s";
}

TEST(BagDrive, ReadsCloudsOfAnyLayout) {
  for (const std::string topic : {"/hesai", "/float64_big", "/organised"}) {
    SCOPED_TRACE(topic);
    const auto drive = OpenBagDrive({.paths = {BagPath("layouts.mcap")}, .topic = topic});
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), 1U);
    EXPECT_LT(WorstError(drive->frames[0]), 0.03);
  }
}

TEST(BagDrive, TakesAnotherMountThatIsGiven) {
  const TempDir dir;
  const std::string calib = dir.Write("calib.txt", "Tr: 1 0 0 5 0 1 0 0 0 0 1 0\n");
  const auto drive =
      OpenBagDrive({.paths = {BagPath("zstd.mcap")}, .poses_from = "/odom", .calib_file = calib});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_NEAR(drive->frames[0].T_map_sensor.translation().x(), 5.0, 1e-9);
}

TEST(BagDrive, ListsScansWithoutPoses) {
  std::vector<std::string> notes;
  const auto scans = ListBagScans({.paths = {BagPath("ros1.bag")}}, notes);
  ASSERT_TRUE(scans.ok()) << scans.status();
  ASSERT_EQ(scans->size(), 7U);
  EXPECT_EQ(ReadScan(scans->front())->points.size(), kPosts.size());
}

TEST(BagDrive, LeavesOutCloudsThatHaveNoPoseInTime) {
  const auto drive = OpenBagDrive({.paths = {BagPath("gap.mcap")}});
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_EQ(drive->frames.size(), 2U);
  EXPECT_EQ(drive->num_without_pose, 5U);
  EXPECT_THAT(drive->notes,
              Contains(HasSubstr("5 of the 7 clouds are left out: no poses lie around them within "
                                 "1 s of each other; the longest gap is that of clouds 2 to 6")));
  const auto late = OpenBagDrive({.paths = {BagPath("late.mcap")}});
  EXPECT_THAT(std::string(late.status().message()),
              AllOf(HasSubstr("none of the 7 clouds has a pose"),
                    HasSubstr("those of the poses 1700003599.900 to 1700003601.950 s")));
}

TEST(BagDrive, TakesTheTimeOfRecordingWhereThereAreNoStamps) {
  const auto drive = OpenBagDrive({.paths = {BagPath("unstamped.mcap")}, .poses_from = "tf:odom"});
  ASSERT_TRUE(drive.ok()) << drive.status();
  ASSERT_EQ(drive->frames.size(), 7U);
  for (const Frame& frame : drive->frames) EXPECT_LT(WorstError(frame), 0.03);
}

TEST(BagDrive, HasNoPosesWhereTwoNodesTellThemInTurn) {
  const auto drive = OpenBagDrive(
      {.paths = {BagPath("zstd.mcap"), BagPath("beside.mcap")}, .poses_from = "/odom"});
  EXPECT_THAT(std::string(drive.status().message()),
              AllOf(HasSubstr("none of the 7 clouds has a pose"),
                    HasSubstr("30 poses lie elsewhere than those just before and after them")));
}

TEST(BagDrive, NotesWherePosesLeapFasterThanAnythingDrives) {
  std::vector<Frame> frames(4);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].stamp_ns = 1'000'000'000 + 100'000'000 * static_cast<std::int64_t>(i);
    frames[i].T_map_sensor = Eigen::Translation3d(5.0 * static_cast<double>(i), 0, 0);
  }
  EXPECT_EQ(LeapText(frames), "") << "50 m/s";
  frames[2].T_map_sensor = frames[3].T_map_sensor = Pose::Identity();
  frames[1].T_map_sensor = Eigen::Translation3d(80, 0, 0);
  EXPECT_THAT(LeapText(frames),
              HasSubstr("leap by 80.0 m within 0.100 s, to the cloud of 1.100 s"));
}

TEST(BagDrive, LeavesOutCloudsThatNameNoFrameWhereOthersDo) {
  const auto drive = OpenBagDrive({.paths = {BagPath("odd_clouds.mcap")}, .poses_from = "/odom"});
  ASSERT_TRUE(drive.ok()) << drive.status();
  ASSERT_EQ(drive->frames.size(), 5U);
  EXPECT_EQ(drive->frames[0].stamp_ns, 1'700'000'000'100'000'000) << "the first names none";
  EXPECT_THAT(drive->notes,
              Contains(HasSubstr("2 clouds of \"/points\" name no frame, where others "
                                 "are of \"velodyne\": they are left out")));
  for (const Frame& frame : drive->frames) EXPECT_LT(WorstError(frame), 0.03);
}

TEST(BagDrive, RefusesCloudsAndPosesOfTwoClocks) {
  const BagDriveOptions options = {.paths = {BagPath("of_ptp.mcap")}, .poses_from = "/odom"};
  const std::string error(OpenBagDrive(options).status().message());
  EXPECT_THAT(error, HasSubstr("clouds have stamps 37.000 s ahead of those of the poses"));
  EXPECT_THAT(error, Not(HasSubstr("none of the")));
  std::vector<std::string> notes;
  EXPECT_EQ(ListBagScans(options, notes)->size(), 7U) << "which need no poses";
  EXPECT_THAT(notes, Contains(HasSubstr("two clocks gave them")));
}

TEST(BagDrive, KnowsClocksFromPosesThatComeLate) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  for (const auto& [offset_s, is_right, is_noted] :
       std::vector<std::tuple<int, bool, bool>>{{0, true, false},
                                                {1, true, false},
                                                {5, true, true},
                                                {-18, false, false},
                                                {37, false, false},
                                                {-400'000, true, true}}) {
    RecordingDelay clouds;
    RecordingDelay poses;
    for (int i = 0; i < 9; ++i) {
      const std::int64_t now_ns = (1'000'000 + i) * kSecond_ns;
      clouds.Add(now_ns, now_ns - i * kSecond_ns / 10);
      poses.Add(now_ns, i < 3 ? 0 : now_ns - offset_s * kSecond_ns);
    }
    std::vector<std::string> notes;
    EXPECT_EQ(CheckClocks(clouds, poses, notes).ok(), is_right) << offset_s;
    EXPECT_EQ(notes.empty(), !is_noted) << offset_s;
    EXPECT_TRUE(CheckClocks(clouds, {}, notes).ok());
  }
}

TEST(BagDrive, SaysHowCloudsComeOfWhatDriversRecordBeside) {
  const TempDir dir;
  for (const auto& [type, advice] : std::vector<std::pair<std::string, std::string>>{
           {"livox_ros_driver2/msg/CustomMsg", "livox_ros_driver2/CustomMsg, Livox's own: "},
           {"velodyne_msgs/msg/VelodyneScan", "VelodyneScan, raw packets: "},
           {"ouster_sensor_msgs/msg/PacketMsg", "PacketMsg, raw packets: "},
           {"sensor_msgs/msg/LaserScan", "(sensor_msgs/LaserScan)"}}) {
    const std::string bag = dir.Write("a.db3", test::ReadFile(BagPath("ros2/ros2.db3")));
    test::Sql(bag, absl::StrCat("UPDATE topics SET type = '", type, "' WHERE name = '/points'"));
    EXPECT_THAT(std::string(OpenBagDrive({.paths = {bag}}).status().message()), HasSubstr(advice));
  }
}

TEST(BagDrive, RefusesWithTheTopicsThereAre) {
  const std::string bag = BagPath("zstd.mcap");
  const TempDir dir;
  for (const auto& [options, reason] : std::vector<std::pair<BagDriveOptions, std::string>>{
           {{.paths = {bag}}, "\"/odom\" (nav_msgs/Odometry), \"/pose\""},
           {{.paths = {bag}, .topic = "/clouds"}, "\"/points\" (sensor_msgs/PointCloud2)"},
           {{.paths = {bag}, .topic = "/odom"}, "is of type nav_msgs/Odometry"},
           {{.paths = {BagPath("called_json.mcap")}},
            "\"/hesai\" (sensor_msgs/PointCloud2, in an encoding that is not read)"},
           {{.paths = {BagPath("called_json.mcap")}, .topic = "/hesai"},
            "PointCloud2, in an encoding that is not read"},
           {{.paths = {bag}, .poses_from = "/points"}, "is of type sensor_msgs/PointCloud2"},
           {{.paths = {bag}, .poses_from = "tf:"}, "tf:map"},
           {{.paths = {bag}, .poses_from = "tf:map:"}, "tf:map:base_link"},
           {{.paths = {bag}, .poses_from = "tf:velodyne"}, "do not move with the robot"},
           {{.paths = {bag}, .poses_from = "tf:velodyne:odom"}, "do not move with the robot"},
           {{.paths = {bag}, .poses_from = "tf:map:tail"}, "no transforms connect frame \"tail\""},
           {{.paths = {bag}, .poses_from = "tf:map:base_link:x"}, "tf:map:base_link"},
           {{.paths = {bag}, .poses_from = "tf:world"}, "no transforms connect frame \"velodyne\""},
           {{.paths = {BagPath("layouts.mcap")}}, "several topics of point clouds"},
           {{.paths = {bag}, .poses_from = "tf:map", .calib_file = "x"}, "--calib is for"},
           {{.paths = {bag}, .poses_from = "/odom", .calib_file = dir.File("none")}, "none"},
           {{.paths = {}}, "no bag"}}) {
    const auto drive = OpenBagDrive(options);
    EXPECT_FALSE(drive.ok());
    EXPECT_THAT(std::string(drive.status().message()), HasSubstr(reason));
  }
}

}  // namespace
}  // namespace scanloc::dataset
