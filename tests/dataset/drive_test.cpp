#include "scanloc/dataset/drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/real_data.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::KittiBytes;
using test::SomePoints;
using test::TempDir;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A drive along x: pose i lies at (i, 0, 0).
std::string KittiRow(double x) { return absl::StrCat("1 0 0 ", x, " 0 1 0 0 0 0 1 0\n"); }

std::string KittiRows(int num_poses) {
  std::string rows;
  for (int i = 0; i < num_poses; ++i) rows += KittiRow(i);
  return rows;
}

std::string TumRow(const std::string& stamp, double x) {
  return absl::StrCat(stamp, " ", x, " 0 0 0 0 0 1\n");
}

void WriteScan(const TempDir& dir, const std::string& name) {
  dir.Write(name, KittiBytes(SomePoints(3)));
}

DriveOptions Options(const TempDir& dir, const std::string& poses) {
  return {.scans_dir = dir.path().string(), .poses_file = dir.Write("poses.txt", poses)};
}

std::vector<std::string> Names(const std::vector<ScanFile>& scans) {
  std::vector<std::string> names;
  names.reserve(scans.size());
  for (const ScanFile& scan : scans) names.push_back(scan.name);
  return names;
}

// Name and x of each frame.
std::vector<std::pair<std::string, double>> Pairs(const Drive& drive) {
  std::vector<std::pair<std::string, double>> pairs;
  for (const Frame& frame : drive.frames) {
    pairs.emplace_back(frame.name, frame.T_map_sensor.translation().x());
  }
  return pairs;
}

std::vector<std::int64_t> Stamps(const Drive& drive) {
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(drive.frames.size());
  for (const Frame& frame : drive.frames) stamps_ns.push_back(frame.stamp_ns);
  return stamps_ns;
}

TEST(ListScans, GivesScanFilesByNameAndNothingElse) {
  const TempDir dir;
  for (const char* name : {"b.pcd", "a.bin", "c.PLY", "notes.txt", ".hidden.bin", "B.bin"}) {
    WriteScan(dir, name);
  }
  std::filesystem::create_directory(dir.path() / "folder.bin");
  const auto scans = ListScans(dir.path().string());
  ASSERT_TRUE(scans.ok()) << scans.status();
  EXPECT_THAT(Names(*scans), ElementsAre("B.bin", "a.bin", "b.pcd", "c.PLY"));
  EXPECT_EQ(scans->front().path, dir.File("B.bin"));
}

TEST(ListScans, LooksIntoASequenceFolder) {
  for (const std::string inner :
       {"velodyne", "Scans", "Ouster", "sensor_data/Ouster", "lidars", "train/lidars"}) {
    const TempDir dir;
    WriteScan(dir, inner + "/000000.bin");
    const auto scans = ListScans(dir.path().string());
    ASSERT_TRUE(scans.ok()) << scans.status();
    EXPECT_EQ(scans->front().path, (dir.path() / inner / "000000.bin").string());
  }
}

TEST(ListScans, RefusesWhatHoldsNoScan) {
  const TempDir dir;
  dir.Write("velodyne/notes.txt", "-");
  EXPECT_EQ(ListScans(dir.File("none")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ListScans(dir.path().string()).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ListScans(dir.File("velodyne/notes.txt")).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(OpenDrive, PairsTheIthScanWithTheIthRow) {
  const TempDir dir;
  for (const char* name : {"000001.bin", "000000.bin", "000002.pcd"}) WriteScan(dir, name);
  const auto drive = OpenDrive(Options(dir, KittiRows(3)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("000000.bin", 0.0), std::pair("000001.bin", 1.0),
                                         std::pair("000002.pcd", 2.0)));
  EXPECT_THAT(Stamps(*drive), ElementsAre(0, 0, 0));
  EXPECT_EQ(drive->num_without_pose, 0U);
}

TEST(OpenDrive, GivesScansTheTimesOfAFile) {
  const TempDir dir;
  for (const char* name : {"0.bin", "1.bin"}) WriteScan(dir, name);
  DriveOptions options = Options(dir, KittiRows(2));
  options.times_file = dir.Write("times.txt", "0.5\n1357847247.396864\n");
  const auto drive = OpenDrive(options);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Stamps(*drive), ElementsAre(500000000, 1357847247396864000));
}

TEST(OpenDrive, AppliesTheCalibration) {
  const TempDir dir;
  WriteScan(dir, "0.bin");
  DriveOptions options = Options(dir, "1 0 0 0 0 1 0 0 0 0 1 5\n");
  options.calib_file = dir.Write("calib.txt", "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
  const auto drive = OpenDrive(options);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_TRUE(
      drive->frames[0].T_map_sensor.translation().isApprox(Eigen::Vector3d(5, 0, 0), 1e-12));
}

TEST(OpenDrive, RefusesMoreScansThanPosesOrFewerNamingBothCounts) {
  for (const int num_poses : {2, 4}) {
    const TempDir dir;
    for (const char* name : {"0.bin", "1.bin", "2.bin"}) WriteScan(dir, name);
    const auto drive = OpenDrive(Options(dir, KittiRows(num_poses)));
    EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(drive.status().message()),
                AllOf(HasSubstr("3 scans"), HasSubstr(absl::StrCat(num_poses, " poses"))));
  }
}

TEST(OpenDrive, RefusesADifferentNumberOfTimes) {
  const TempDir dir;
  for (const char* name : {"0.bin", "1.bin"}) WriteScan(dir, name);
  DriveOptions options = Options(dir, KittiRows(2));
  options.times_file = dir.Write("times.txt", "0\n1\n2\n");
  const auto drive = OpenDrive(options);
  EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(drive.status().message()),
              AllOf(HasSubstr("3 times"), HasSubstr("2 scans")));
}

TEST(OpenDrive, OrdersNumbersInNamesAsNumbers) {
  const TempDir dir;
  for (const char* name : {"run7_10.bin", "run7_9.bin", "run7_8.bin"}) WriteScan(dir, name);
  const auto drive = OpenDrive(Options(dir, KittiRows(3)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("run7_8.bin", 0.0), std::pair("run7_9.bin", 1.0),
                                         std::pair("run7_10.bin", 2.0)));
}

TEST(OpenDrive, RefusesNamesThatCanBeOrderedInTwoWays) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"scan9.bin", "scan10.bin", "scan11b.bin"},
        std::vector<std::string>{"7.25.bin", "7.5.bin", "8.125.bin"}}) {
    const TempDir dir;
    for (const std::string& name : names) WriteScan(dir, name);
    for (const std::string& poses :
         {KittiRows(3), TumRow("7", 1) + TumRow("8", 2) + TumRow("9", 3)}) {
      const auto drive = OpenDrive(Options(dir, poses));
      EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument) << names[0];
      EXPECT_THAT(std::string(drive.status().message()), HasSubstr("order of the scans"));
    }
  }
}

TEST(OpenDrive, PairsScansNamedInSecondsAndWholeNanosecondsWithTheNearestPose) {
  const TempDir dir;
  // .05 and .95 s after a full second.
  for (const char* name : {"1741286117_950000000.bin", "1741286118_50000000.bin"}) {
    WriteScan(dir, name);
  }
  const auto drive = OpenDrive(Options(
      dir, TumRow("1741286118.05", 2) + TumRow("1741286117.95", 1) + TumRow("1741286118.5", 3)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("1741286117_950000000.bin", 1.0),
                                         std::pair("1741286118_50000000.bin", 2.0)));
  EXPECT_THAT(drive->notes, ::testing::Contains(HasSubstr("whole nanoseconds")));
}

TEST(OpenDrive, PairsFramesByTheirNumbers) {
  const TempDir dir;
  for (const char* name : {"0000000007.bin", "0000000008.bin", "0000000012.bin"}) {
    WriteScan(dir, name);
  }
  const auto drive = OpenDrive(Options(dir, "12 " + KittiRow(5) + "7 " + KittiRow(3)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive),
              ElementsAre(std::pair("0000000007.bin", 3.0), std::pair("0000000012.bin", 5.0)));
  EXPECT_EQ(drive->num_without_pose, 1U);
  EXPECT_FALSE(OpenDrive(Options(dir, "7 " + KittiRow(5) + "7 " + KittiRow(3))).ok());
  EXPECT_FALSE(OpenDrive(Options(dir, "1 " + KittiRow(5))).ok());
}

TEST(OpenDrive, RefusesTimesThatFallWhereRowsArePairedInOrder) {
  const TempDir dir;
  for (const char* name : {"0.bin", "1.bin", "2.bin"}) WriteScan(dir, name);
  DriveOptions options = Options(dir, TumRow("5", 1) + TumRow("6", 2) + TumRow("4", 0));
  EXPECT_THAT(std::string(OpenDrive(options).status().message()), HasSubstr("poses.txt: time 3"));
  options = Options(dir, KittiRows(3));
  options.times_file = dir.Write("times.txt", "5\n4\n6\n");
  EXPECT_THAT(std::string(OpenDrive(options).status().message()), HasSubstr("times.txt: time 2"));
  // Where stamps pair them, the order of the rows does not matter, but that of the times is told.
  options = Options(dir, TumRow("6", 6) + TumRow("5", 5) + TumRow("4", 4));
  options.times_file = dir.File("times.txt");
  const auto drive = OpenDrive(options);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("0.bin", 5.0), std::pair("1.bin", 4.0),
                                         std::pair("2.bin", 6.0)));
  EXPECT_THAT(drive->notes, ::testing::Contains(HasSubstr("do not rise")));
}

TEST(OpenDrive, PassesOnWhatIsWrongWithItsFiles) {
  const TempDir dir;
  WriteScan(dir, "0.bin");
  DriveOptions options = Options(dir, "1 2 3\n");
  EXPECT_THAT(std::string(OpenDrive(options).status().message()), HasSubstr("poses.txt:1"));
  options.poses_file = dir.File("none.txt");
  EXPECT_EQ(OpenDrive(options).status().code(), absl::StatusCode::kNotFound);
  options.poses_file = "";
  EXPECT_EQ(OpenDrive(options).status().code(), absl::StatusCode::kInvalidArgument);
  options.scans_dir = "";
  EXPECT_EQ(OpenDrive(options).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(OpenDrive, PairsStampedScansWithTheNearestPose) {
  const TempDir dir;
  for (const char* name : {"1567410201000000000.bin", "1567410201100000000.bin"}) {
    WriteScan(dir, name);
  }
  std::string rows;
  // Not in order, and more rows than scans.
  for (const auto& [stamp, x] :
       std::vector<std::pair<std::string, double>>{{"1567410201090000000", 9},
                                                   {"1567410200990000001", 1},
                                                   {"1567410201010000000", 2},
                                                   {"1567410201120000000", 3}}) {
    absl::StrAppend(&rows, stamp, ",1,0,0,", x, ",0,1,0,0,0,0,1,0\n");
  }
  DriveOptions options = Options(dir, rows);
  options.calib_file = dir.Write("calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto drive = OpenDrive(options);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("1567410201000000000.bin", 1.0),
                                         std::pair("1567410201100000000.bin", 9.0)));
  EXPECT_THAT(Stamps(*drive), ElementsAre(1567410201000000000, 1567410201100000000));
}

TEST(OpenDrive, PairsScansNamedInMicrosecondsOrSecondsWithTumPoses) {
  for (const std::string name : {"1305031102175304.bin", "1305031102.175304.bin"}) {
    const TempDir dir;
    WriteScan(dir, name);
    const auto drive =
        OpenDrive(Options(dir, TumRow("1305031102.0", 1) + TumRow("1305031102.1753", 2)));
    ASSERT_TRUE(drive.ok()) << drive.status();
    EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair(name, 2.0)));
  }
}

TEST(OpenDrive, PairsScansThatHaveAFileOfTimesWithStampedPoses) {
  const TempDir dir;
  for (const char* name : {"0.bin", "1.bin"}) WriteScan(dir, name);
  DriveOptions options = Options(dir, TumRow("5.0", 1) + TumRow("5.5", 2) + TumRow("6.0", 3));
  options.times_file = dir.Write("times.txt", "5.02\n5.99\n");
  const auto drive = OpenDrive(options);
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("0.bin", 1.0), std::pair("1.bin", 3.0)));
}

TEST(OpenDrive, LeavesOutAndCountsStampedScansWithoutAPose) {
  const TempDir dir;
  for (const char* name : {"1.0.bin", "2.0.bin", "2.1.bin", "3.0.bin"}) WriteScan(dir, name);
  const auto drive = OpenDrive(Options(dir, TumRow("2.0", 2) + TumRow("900", 9)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("2.0.bin", 2.0), std::pair("2.1.bin", 2.0)));
  EXPECT_EQ(drive->num_without_pose, 2U);
}

TEST(OpenDrive, RefusesStampsThatNeverMeet) {
  const TempDir dir;
  WriteScan(dir, "1567410201000000000.bin");
  const auto drive = OpenDrive(Options(dir, TumRow("-9223372036", 0) + TumRow("9223372036", 0)));
  EXPECT_EQ(drive.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(drive.status().message()), HasSubstr("none of the 1 scans"));
  EXPECT_THAT(std::string(drive.status().message()),
              HasSubstr("100 ms of a pose of " + dir.File("poses.txt") +
                        "; the first scan's stamp is 1567410201.000 s"));
}

TEST(OpenDrive, PairsStampedPosesByRowWhereScansHaveNoStamps) {
  const TempDir dir;
  for (const char* name : {"0.bin", "1.bin"}) WriteScan(dir, name);
  const auto drive = OpenDrive(Options(dir, TumRow("5.0", 1) + TumRow("5.5", 2)));
  ASSERT_TRUE(drive.ok()) << drive.status();
  EXPECT_THAT(Pairs(*drive), ElementsAre(std::pair("0.bin", 1.0), std::pair("1.bin", 2.0)));
  EXPECT_THAT(Stamps(*drive), ElementsAre(5000000000, 5500000000));
  EXPECT_FALSE(OpenDrive(Options(dir, TumRow("5.0", 1))).ok());
}

TEST(OpenDriveOnRealData, OpensEveryDriveAndReadsItsFirstScan) {
  SCANLOC_REAL_DATA_OR_SKIP(root, "nclt-2013-01-10");
  struct Expected {
    std::string folder;
    std::size_t num_frames;
    bool has_times;
  };
  for (const auto& [folder, num_frames, has_times] :
       {Expected{"nclt-2013-01-10", 551, true}, Expected{"kitti-00-first-827m", 456, false},
        Expected{"mulran-kaist03-21", 21, true}}) {
    const std::string path = absl::StrCat(root, "/../", folder);
    DriveOptions options{.scans_dir = path, .poses_file = path + "/poses.txt"};
    if (has_times) options.times_file = path + "/times.txt";
    const auto drive = OpenDrive(options);
    ASSERT_TRUE(drive.ok()) << drive.status();
    ASSERT_EQ(drive->frames.size(), num_frames);
    EXPECT_EQ(drive->frames.front().stamp_ns != 0, has_times);
    EXPECT_TRUE(ReadScan(drive->frames.front().path).ok());
  }
}

}  // namespace
}  // namespace scanloc::dataset
