#include "scanloc/dataset/pose_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "support/real_data.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::TempDir;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kIdentityRow = "1 0 0 0 0 1 0 0 0 0 1 0";
// Turned by 90° to the left, at (1, 2, 3).
const std::string kTurnedRow = "0 -1 0 1 1 0 0 2 0 0 1 3";

Pose Turned() {
  return Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
}

absl::StatusOr<Trajectory> Read(const std::string& content, PoseFormat format = PoseFormat::kAuto) {
  const TempDir dir;
  return ReadTrajectory(dir.Write("poses.txt", content), format);
}

TEST(PoseReader, ReadsKittiRows) {
  const auto trajectory = Read(absl::StrCat(kIdentityRow, "\n", kTurnedRow, "\n"));
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->format, PoseFormat::kKitti);
  EXPECT_THAT(trajectory->stamps_ns, IsEmpty());
  ASSERT_EQ(trajectory->T_map_sensor.size(), 2U);
  EXPECT_TRUE(trajectory->T_map_sensor[0].isApprox(Pose::Identity(), 1e-12));
  EXPECT_TRUE(trajectory->T_map_sensor[1].isApprox(Turned(), 1e-12));
}

TEST(PoseReader, TakesRowsForThoseOfABodyWhoseSensorIsTold) {
  const TempDir dir;
  const Pose T_body_sensor =
      Eigen::Translation3d(0.5, 0, 1) * Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX());
  const std::string stamp = "1567410201812840928,";
  for (const std::string& row :
       {kTurnedRow, stamp + absl::StrReplaceAll(kTurnedRow, {{" ", ","}})}) {
    const auto trajectory =
        ReadTrajectory(dir.Write("poses.txt", row + "\n"), PoseFormat::kAuto, "", T_body_sensor);
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_TRUE(trajectory->T_map_sensor[0].isApprox(Turned() * T_body_sensor, 1e-12)) << row;
  }
}

TEST(PoseReader, ReadsTumRowsWithComments) {
  const auto trajectory = Read(
      "# stamp tx ty tz qx qy qz qw\n"
      "1305031102.175304123 1 2 3 0 0 0.70710678 0.70710678\n"
      "#\n"
      "-0.5 0 0 0 0 0 0 1\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->format, PoseFormat::kTum);
  EXPECT_THAT(trajectory->stamps_ns, ElementsAre(1305031102175304123, -500000000));
  ASSERT_EQ(trajectory->T_map_sensor.size(), 2U);
  EXPECT_TRUE(trajectory->T_map_sensor[0].isApprox(Turned(), 1e-7));
}

TEST(PoseReader, ReadsMulranRows) {
  const auto trajectory = Read(
      "1567410201812840928,1,0,0,0.5,0,1,0,0,0,0,1,0\n"
      "1567410201822840929, 0,-1,0,1, 1,0,0,2, 0,0,1,3\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->format, PoseFormat::kMulran);
  EXPECT_THAT(trajectory->stamps_ns, ElementsAre(1567410201812840928, 1567410201822840929));
  ASSERT_EQ(trajectory->T_map_sensor.size(), 2U);
  // The rows are of the vehicle, the poses of the Ouster on it.
  const Eigen::Vector3d mount_m(1.7042, -0.021, 1.8047);
  EXPECT_TRUE(trajectory->T_map_sensor[1].translation().isApprox(Turned() * mount_m, 1e-9));
}

TEST(PoseReader, TakesTrailingBlankLinesAndWindowsLineEnds) {
  const auto trajectory = Read(absl::StrCat(kIdentityRow, " \r\n", kTurnedRow, "\r\n\r\n \r\n"));
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->T_map_sensor.size(), 2U);
}

TEST(PoseReader, PassesOverTheMarkBeforeUtf8AndNamesUtf16) {
  for (const std::string& text :
       {kTurnedRow, "# a comment\n" + kTurnedRow,
        std::string("x,y,z,qw,qx,qy,qz\n1,2,3,0.70710678,0,0,0.70710678")}) {
    const auto trajectory = Read("\xEF\xBB\xBF" + text);
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_TRUE(trajectory->T_map_sensor[0].isApprox(Turned(), 1e-7));
  }
  EXPECT_THAT(std::string(Read(std::string("\xFF\xFE"
                                           "1\0 \0",
                                           6))
                              .status()
                              .message()),
              HasSubstr("poses.txt: is text in UTF-16"));
}

TEST(PoseReader, TakesALastLineWithoutEnd) {
  const auto trajectory = Read(kTurnedRow);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->T_map_sensor.size(), 1U);
}

TEST(PoseReader, TakesRotationsRoundedToSixDigits) {
  const auto trajectory = Read(
      "0.480565 -0.87665 0.0232866 0.687383 0.876925 0.48061 -0.00401009 0.55236 "
      "-0.0076763 0.0223477 0.999721 0.786151");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const Eigen::Matrix3d rotation = trajectory->T_map_sensor[0].linear();
  EXPECT_TRUE((rotation * rotation.transpose()).isIdentity(1e-12));
}

struct BadPoses {
  std::string content;
  PoseFormat format;
  std::string place;   ///< file:line of the message
  std::string reason;  ///< what the message says of it
};

void ExpectRefusal(const BadPoses& bad) {
  SCOPED_TRACE(bad.content);
  const auto trajectory = Read(bad.content, bad.format);
  ASSERT_FALSE(trajectory.ok());
  EXPECT_EQ(trajectory.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(trajectory.status().message()),
              AllOf(HasSubstr(bad.place), HasSubstr(bad.reason)));
}

TEST(PoseReader, RefusesBadRowsWithFileLineAndReason) {
  const std::vector<BadPoses> table = {
      BadPoses{"", PoseFormat::kAuto, "poses.txt", "empty"},
      BadPoses{"\n\n", PoseFormat::kAuto, "poses.txt", "no row"},
      BadPoses{"# only a comment\n", PoseFormat::kAuto, "poses.txt", "no row"},
      BadPoses{"1 2 3\n", PoseFormat::kAuto, "poses.txt:1", "has 3 values"},
      BadPoses{kIdentityRow + " 1\n", PoseFormat::kKitti, "poses.txt:1", "12 are needed"},
      BadPoses{kIdentityRow + "\n1 0 0 0\n", PoseFormat::kAuto, "poses.txt:2", "has 4 values"},
      BadPoses{kIdentityRow + "\n\n" + kIdentityRow + "\n", PoseFormat::kAuto, "poses.txt:2",
               "blank line"},
      BadPoses{"1 0 0 0 0 1 0 zero 0 0 1 0\n", PoseFormat::kAuto, "poses.txt:1",
               "\"zero\" is not a number"},
      BadPoses{"1 0 0 0 0 1 0 1.0.0 0 0 1 0\n", PoseFormat::kAuto, "poses.txt:1", "\"1.0.0\""},
      BadPoses{"1 0 0 0 0 1 0 nan 0 0 1 0\n", PoseFormat::kAuto, "poses.txt:1", "nan"},
      BadPoses{"1 0 0 0 0 1 0 inf 0 0 1 0\n", PoseFormat::kAuto, "poses.txt:1", "inf"},
      BadPoses{"2 0 0 0 0 2 0 0 0 0 2 0\n", PoseFormat::kAuto, "poses.txt:1", "rotation"},
      BadPoses{"1 0 0 0 0 1 0 0 0 0 -1 0\n", PoseFormat::kAuto, "poses.txt:1", "rotation"},
      BadPoses{"0 0 0 0 0 0 0 0 0 0 0 0\n", PoseFormat::kAuto, "poses.txt:1", "rotation"},
      BadPoses{"1 0 0 1e12 0 1 0 0 0 0 1 0\n", PoseFormat::kAuto, "poses.txt:1", "e+12"},
      BadPoses{kIdentityRow, PoseFormat::kTum, "poses.txt:1", "8 are needed"},
      BadPoses{kIdentityRow, PoseFormat::kMulran, "poses.txt:1", "13 are needed"},
      BadPoses{"1.0 0 0 0 0 0 0 2\n", PoseFormat::kTum, "poses.txt:1", "quaternion"},
      BadPoses{"1.0 0 0 0 0 0 0 0\n", PoseFormat::kTum, "poses.txt:1", "quaternion"},
      BadPoses{"1.0 0 0 0 0 0 0 nan\n", PoseFormat::kTum, "poses.txt:1", "nan"},
      BadPoses{"now 0 0 0 0 0 0 1\n", PoseFormat::kTum, "poses.txt:1", "\"now\""},
      BadPoses{"1.5,1,0,0,0,0,1,0,0,0,0,1,0\n", PoseFormat::kMulran, "poses.txt:1", "\"1.5\""},
      BadPoses{"1,1,0,,0,0,1,0,0,0,0,1,0\n", PoseFormat::kMulran, "poses.txt:1", "not a number"},
      BadPoses{"1,1,0,0 0,0,0,1,0,0,0,0,1,0\n", PoseFormat::kMulran, "poses.txt:1", "\"0 0\""}};
  for (const BadPoses& bad : table) ExpectRefusal(bad);
}

TEST(PoseReader, GivesPosesOrARefusalWhateverHappensToTheFile) {
  constexpr std::uint32_t kSeed = 3;
  const TempDir dir;
  std::mt19937 random(kSeed);
  const std::vector<std::string> samples = {
      absl::StrCat(kIdentityRow, "\n", kTurnedRow, "\n"),
      "# stamp\n1305031102.175304123 1 2 3 0 0 0.70710678 0.70710678\n",
      "1567410201812840928,1,0,0,0.5,0,1,0,0,0,0,1,0\n"};
  for (const std::string& sample : samples) {
    for (int i = 0; i < 300; ++i) {
      SCOPED_TRACE(absl::StrCat("seed ", kSeed, ", mutation ", i));
      std::string content = sample.substr(0, 1 + random() % sample.size());
      content[random() % content.size()] = static_cast<char>(random());
      const std::string path = dir.Write("poses.txt", content);
      for (const absl::Status& status :
           {ReadTrajectory(path).status(), ReadTimes(path).status(), ReadCalib(path).status()}) {
        EXPECT_TRUE(status.ok() || status.code() == absl::StatusCode::kInvalidArgument) << status;
      }
    }
  }
}

TEST(PoseReader, RefusesALineOfAMillionValues) {
  for (const char* value : {"1 ", "1,"}) {
    std::string content;
    for (int i = 0; i < 1'000'000; ++i) content += value;
    EXPECT_EQ(Read(content).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(PoseReader, SaysThatAFileIsMissing) {
  const TempDir dir;
  EXPECT_EQ(ReadTrajectory(dir.File("none.txt")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadTimes(dir.File("none.txt")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadCalib(dir.File("none.txt")).status().code(), absl::StatusCode::kNotFound);
}

TEST(PoseReader, NamesFormatsBothWays) {
  for (const PoseFormat format : {PoseFormat::kAuto, PoseFormat::kKitti, PoseFormat::kTum,
                                  PoseFormat::kMulran, PoseFormat::kNclt, PoseFormat::kOxford,
                                  PoseFormat::kNaver, PoseFormat::kMatrix, PoseFormat::kKitti360}) {
    const absl::StatusOr<PoseFormat> parsed = ParsePoseFormat(PoseFormatName(format));
    ASSERT_TRUE(parsed.ok());
    EXPECT_EQ(*parsed, format);
  }
  EXPECT_THAT(std::string(ParsePoseFormat("g2o").status().message()), HasSubstr("\"g2o\""));
}

// Camera axes: x right, y down, z forward; the camera sits 0.3 m before the sensor and 0.1 m below.
const std::string kCalib = "P0: 7 0 6 0 0 7 1 0 0 0 1 0\n\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n";

TEST(PoseReader, TurnsCameraPosesIntoSensorPoses) {
  const TempDir dir;
  // The camera drives 5 m forward, its z, and turns left, about its -y.
  const std::string poses = dir.Write(
      "poses.txt", kIdentityRow + "\n1 0 0 0 0 1 0 0 0 0 1 5\n0 0 -1 0 0 1 0 0 1 0 0 0\n");
  const auto trajectory = ReadTrajectory(poses, PoseFormat::kKitti, dir.Write("calib.txt", kCalib));
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const std::vector<Pose>& T_map_sensor = trajectory->T_map_sensor;
  ASSERT_EQ(T_map_sensor.size(), 3U);
  EXPECT_TRUE(T_map_sensor[0].isApprox(Pose::Identity(), 1e-12));
  EXPECT_TRUE(T_map_sensor[1].isApprox(Pose(Eigen::Translation3d(5, 0, 0)), 1e-12));
  // Turning about the camera swings the sensor, 0.3 m behind it, to the right.
  const Pose turned = Eigen::Translation3d(0.3, -0.3, 0) *
                      Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(T_map_sensor[2].isApprox(turned, 1e-12)) << T_map_sensor[2].matrix();
}

TEST(PoseReader, AddsTheMountingOfTheSensorToVehiclePoses) {
  const TempDir dir;
  const std::string poses = dir.Write("poses.txt", "7 1 2 3 0 0 0.70710678 0.70710678\n");
  const std::string calib = dir.Write("calib.txt", "Tr: 1 0 0 0.5 0 1 0 0 0 0 1 1.7\n");
  const auto trajectory = ReadTrajectory(poses, PoseFormat::kTum, calib);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_TRUE(
      trajectory->T_map_sensor[0].translation().isApprox(Eigen::Vector3d(1, 2.5, 4.7), 1e-7));
}

TEST(PoseReader, RefusesCalibrationWithoutAGoodTrRow) {
  const TempDir dir;
  const std::string poses = dir.Write("poses.txt", kIdentityRow);
  for (const auto& [content, reason] : std::vector<std::pair<std::string, std::string>>{
           {"P0: 1 2 3\n", "no row \"Tr: \""},
           {"Tr: 1 0 0 0\n", "calib.txt:1: has 5 values"},
           {"\nTr: 1 0 0 0 0 1 0 0 0 0 1 x\n", "calib.txt:2: \"x\""},
           {"Tr: 1 0 0 0 0 3 0 0 0 0 1 0\n", "rotation"},
           {kCalib + kCalib, "second"}}) {
    const auto trajectory =
        ReadTrajectory(poses, PoseFormat::kAuto, dir.Write("calib.txt", content));
    EXPECT_EQ(trajectory.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(trajectory.status().message()), HasSubstr(reason));
  }
}

TEST(TimesReader, ReadsDecimalTextExactly) {
  const TempDir dir;
  const auto stamps_ns = ReadTimes(
      dir.Write("times.txt",
                "0\r\n0.000000e+00\n1.038620e-01\n1567410201.7452047\n1357847247.396864123\n"
                "+1.\n.5\n-2.25\n9223372036.854775807\n0.0000000014\n0.0000000015\n1E2\n"
                "1234567890.12345678949999999999999999\n1e-30\n\n"));
  ASSERT_TRUE(stamps_ns.ok()) << stamps_ns.status();
  EXPECT_THAT(*stamps_ns,
              ElementsAre(0, 0, 103862000, 1567410201745204700, 1357847247396864123, 1000000000,
                          500000000, -2250000000, std::numeric_limits<std::int64_t>::max(), 1, 2,
                          100000000000, 1234567890123456789, 0));
}

TEST(TimesReader, RefusesWhatIsNoTime) {
  const TempDir dir;
  for (const char* token :
       {"now", "1.2.3", "nan", "inf", "-", ".", "e5", "1e", "1e5x", "0x10", "9223372036.854775808",
        "1e10", "1e999999999999", "1e1001", "1,5", "1 2"}) {
    const auto stamps_ns = ReadTimes(dir.Write("times.txt", absl::StrCat("0.5\n", token, "\n")));
    EXPECT_EQ(stamps_ns.status().code(), absl::StatusCode::kInvalidArgument) << token;
    EXPECT_THAT(std::string(stamps_ns.status().message()), HasSubstr("times.txt:2: ")) << token;
  }
  EXPECT_FALSE(ReadTimes(dir.Write("times.txt", std::string(1000, '9'))).ok());
  EXPECT_FALSE(ReadTimes(dir.Write("times.txt", "\n")).ok());
}

TEST(PoseReaderOnRealData, ReadsPosesAndTimesOfEveryDrive) {
  SCANLOC_REAL_DATA_OR_SKIP(root, "nclt-2013-01-10");
  const std::string data = root + "/../";
  for (const auto& [drive, num] : std::vector<std::pair<std::string, std::size_t>>{
           {"nclt-2013-01-10", 551}, {"kitti-00-first-827m", 456}, {"mulran-kaist03-21", 21}}) {
    const auto trajectory = ReadTrajectory(data + drive + "/poses.txt");
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_EQ(trajectory->format, PoseFormat::kKitti);
    EXPECT_EQ(trajectory->T_map_sensor.size(), num);
  }
  const auto nclt = ReadTimes(data + "nclt-2013-01-10/times.txt");
  ASSERT_TRUE(nclt.ok()) << nclt.status();
  EXPECT_EQ(nclt->size(), 551U);
  EXPECT_EQ(nclt->front(), 1357847247396864000);
  const auto mulran = ReadTimes(data + "mulran-kaist03-21/times.txt");
  ASSERT_TRUE(mulran.ok()) << mulran.status();
  EXPECT_EQ(mulran->front(), 1567410201745204700);
}

}  // namespace
}  // namespace scanloc::dataset
