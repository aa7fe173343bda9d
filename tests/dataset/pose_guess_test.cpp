// Files of poses whose format has to be told, and what is said of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/pose_reader.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::TempDir;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

absl::StatusOr<Trajectory> Read(const std::string& content, PoseFormat format = PoseFormat::kAuto) {
  const TempDir dir;
  return ReadTrajectory(dir.Write("poses.txt", content), format);
}

// A drive round a bend, x y z and heading; its quaternions are 0 0 sin cos.
struct At {
  double x, y, yaw_rad;
};
const std::vector<At> kDrive = {
    {1.0, 2.0, 0.3}, {2.0, 2.5, 0.9}, {2.5, 3.5, 2.0}, {2.0, 5.0, -2.5}};

// A file of a row for each pose. Letters stand for values: x y z, abcd for qx qy qz qw, T for a
// stamp of 0.1 s steps; the rest is copied.
std::string Rows(const std::string& pattern, const std::string& stamp_before = "1583836591.",
                 const std::string& stamp_after = "") {
  std::string text;
  for (std::size_t i = 0; i < kDrive.size(); ++i) {
    const At& at = kDrive[i];
    for (const char c : pattern) {
      switch (c) {
        case 'x':
          absl::StrAppend(&text, at.x);
          break;
        case 'y':
          absl::StrAppend(&text, at.y);
          break;
        case 'z':
          absl::StrAppend(&text, 0.5);
          break;
        case 'a':
        case 'b':
          absl::StrAppend(&text, 0);
          break;
        case 'c':
          absl::StrAppend(&text, std::sin(0.5 * at.yaw_rad));
          break;
        case 'd':
          absl::StrAppend(&text, std::cos(0.5 * at.yaw_rad));
          break;
        case 'T':
          absl::StrAppend(&text, stamp_before, i + 1, stamp_after);
          break;
        default:
          text += c;
      }
    }
    text += '\n';
  }
  return text;
}

void ExpectDrive(const absl::StatusOr<Trajectory>& read) {
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->T_map_sensor.size(), kDrive.size());
  for (std::size_t i = 0; i < kDrive.size(); ++i) {
    const Pose& pose = read->T_map_sensor[i];
    EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(kDrive[i].x, kDrive[i].y, 0.5), 1e-5));
    EXPECT_NEAR(Yaw(pose), kDrive[i].yaw_rad, 1e-4);
    EXPECT_NEAR(pose.linear()(2, 2), 1.0, 1e-5);
  }
}

TEST(PoseGuess, TakesAFirstRowWithoutNumbersForAHeadline) {
  for (const std::string& content : {"timestamp,x,y,z,qx,qy,qz,qw\n" + Rows("T,x,y,z,a,b,c,d"),
                                     "stamp; of the pose\n" + Rows("T x y z a b c d")}) {
    const auto read = Read(content);
    ExpectDrive(read);
    EXPECT_EQ(read->stamps_ns.at(0), 1583836591100000000);
    EXPECT_THAT(read->notes, ElementsAre(HasSubstr("stamp [s]")));
  }
  EXPECT_THAT(std::string(Read("timestamp,x,y,z,qx,qy,qz,qw\n").status().message()),
              HasSubstr("holds no pose"));
}

TEST(PoseGuess, TakesTheColumnsThatAHeadlineNames) {
  for (const std::string& content :
       {"# stamp tx ty tz qw qx qy qz\n" + Rows("T x y z d a b c"),
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
        "q_RS_z [],v_RS_R_x [m s^-1]\n" +
            Rows("T,x,y,z,d,a,b,c,9.5", "158383659", "00000000"),
        "%time,frame_id,pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,"
        "pose.orientation.y,pose.orientation.z,pose.orientation.w\n" +
            Rows("T,map,x,y,z,a,b,c,d", "158383659", "00000000"),
        "counter, sec, nsec, qx, qy, qz, qw, x, y, z\n" +
            Rows("7,1583836591,T,a,b,c,d,x,y,z", "", "00000000")}) {
    SCOPED_TRACE(content);
    const auto read = Read(content);
    ExpectDrive(read);
    EXPECT_EQ(read->stamps_ns.size(), kDrive.size());
    EXPECT_THAT(read->notes, ElementsAre(HasSubstr("as the headline says")));
  }
}

TEST(PoseGuess, TakesSemicolonsBetweenValues) {
  for (const std::string headline : {"", "t;x;y;z;qx;qy;qz;qw\n"}) {
    const auto read = Read(headline + Rows("T; x; y; z; a; b; c; d"));
    ExpectDrive(read);
  }
}

TEST(PoseGuess, NamesCommasThatStandForPoints) {
  for (const char between : {';', ' ', '\t'}) {
    std::string rows;
    for (const std::string value :
         {"1583836591,5", "1,5", "2,5", "0,5", "0,0", "0,0", "0,6", "0,8"}) {
      absl::StrAppend(&rows, rows.empty() ? "" : std::string(1, between), value);
    }
    const auto read = Read(rows + "\n");
    EXPECT_THAT(std::string(read.status().message()),
                HasSubstr("poses.txt:1: \"1583836591,5\" has a comma for a point"));
  }
}

TEST(PoseGuess, TellsTheOrderOfPositionAndQuaternion) {
  for (const auto& [pattern, order] : std::vector<std::pair<std::string, std::string>>{
           {"x y z a b c d", "tx ty tz qx qy qz qw"},
           {"x y z d a b c", "tx ty tz qw qx qy qz"},
           {"a b c d x y z", "qx qy qz qw tx ty tz"},
           {"d,a,b,c,x,y,z", "qw qx qy qz tx ty tz"},
           {"T x y z a b c d", "tx ty tz qx qy qz qw"},
           {"T x y z d a b c", "tx ty tz qw qx qy qz"},
           {"T d a b c x y z", "qw qx qy qz tx ty tz"}}) {
    SCOPED_TRACE(pattern);
    const auto read = Read(Rows(pattern));
    ExpectDrive(read);
    EXPECT_EQ(read->stamps_ns.empty(), pattern[0] != 'T');
    EXPECT_THAT(read->notes, ElementsAre(HasSubstr(order)));
  }
}

TEST(PoseGuess, KeepsTheOrderOfAFormatThatIsAskedFor) {
  // A sensor upside down that heads along x: w first it would stand upright.
  const std::string rows = "1 0 0 0 1 0 0 0\n2 1 0 0 1 0 0 0\n";
  EXPECT_NEAR(Read(rows, PoseFormat::kTum)->T_map_sensor[0].linear()(2, 2), -1.0, 1e-9);
  EXPECT_THAT(Read(rows, PoseFormat::kTum)->notes, IsEmpty());
}

TEST(PoseGuess, TellsTheUnitOfStamps) {
  for (const auto& [before, after, unit] :
       std::vector<std::tuple<std::string, std::string, std::string>>{
           {"1583836591.", "", "[s]"},
           {"1583836591", "00", "[ms]"},
           {"1583836591", "00000", "[us]"},
           {"1583836591", "00000000", "[ns]"}}) {
    const auto read = Read(Rows("T x y z a b c d", before, after));
    ExpectDrive(read);
    EXPECT_EQ(read->stamps_ns.at(1), 1583836591200000000);
    EXPECT_THAT(read->notes, ElementsAre(HasSubstr(unit)));
  }
  const auto two = Read(Rows("1583836591 T x y z a b c d", "", "0000000"));
  ExpectDrive(two);
  EXPECT_EQ(two->stamps_ns.at(0), 1583836591010000000);
}

TEST(PoseGuess, ReadsFramesWithMatricesAsPosesOfTheSensor) {
  for (const std::string last : {"", " 0 0 0 1"}) {
    const auto read = Read("3 0 -1 0 1 1 0 0 2 0 0 1 3" + last + "\n");
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->format, PoseFormat::kKitti360);
    EXPECT_THAT(read->frame_numbers, ElementsAre(3));
    EXPECT_TRUE(read->T_map_sensor[0].translation().isApprox(Eigen::Vector3d(1, 2, 3), 1e-12));
    EXPECT_THAT(read->notes, ElementsAre(HasSubstr("--calib")));
  }
}

TEST(PoseGuess, ReadsMatricesWithACommaAtTheEndOfLines) {
  const auto read = Read("0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1,\n");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->format, PoseFormat::kMatrix);
  EXPECT_TRUE(read->T_map_sensor.at(0).translation().isApprox(Eigen::Vector3d(1, 2, 3), 1e-12));
  EXPECT_THAT(read->stamps_ns, IsEmpty());
  EXPECT_THAT(read->notes, ElementsAre(HasSubstr("poses of the sensor")));
}

TEST(PoseGuess, TakesTheTimeInTheCornerOfMatrices) {
  const std::string rows = "1,0,0,0,\n0,1,0,0,\n0,0,1,0,\n0,0,0,";
  const auto read = Read(rows + "5.5\n" + rows + "6.25\n");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->stamps_ns, ElementsAre(5500000000, 6250000000));
  EXPECT_THAT(std::string(Read(rows + "5.5\n" + rows + "5.5\n").status().message()),
              HasSubstr("last row of matrix 1"));
}

TEST(PoseGuess, SaysWhatAFormatDoesToItsRows) {
  for (const auto& [content, format, what] :
       std::vector<std::tuple<std::string, PoseFormat, std::string>>{
           {"1567410201812840928,1,0,0,0,0,1,0,0,0,0,1,0\n", PoseFormat::kMulran, "Ouster"},
           {"1357847248396800,1,2,3,0,0,0\n", PoseFormat::kNclt, "negated"}}) {
    for (const PoseFormat given : {PoseFormat::kAuto, format}) {
      const auto read = Read(content, given);
      ASSERT_TRUE(read.ok()) << read.status();
      EXPECT_EQ(read->format, format);
      EXPECT_THAT(read->notes, ElementsAre(HasSubstr(what)));
    }
  }
  // Twelve values can only be one thing, to which nothing is done.
  EXPECT_THAT(Read("1 0 0 0 0 1 0 0 0 0 1 0\n")->notes, IsEmpty());
}

TEST(PoseGuess, RefusesWhatIsNotTypicalOfAFormat) {
  for (const auto& [content, reason] : std::vector<std::pair<std::string, std::string>>{
           // MulRan's length: no stamp of 19 digits, or no commas.
           {"15674102.5,1,0,0,0,0,1,0,0,0,0,1,0\n", "19 digits"},
           {"1567410201812840928 1 0 0 0 0 1 0 0 0 0 1 0\n", "19 digits"},
           // NCLT's length: frames with x y z roll pitch yaw.
           {"0 1 2 0 0 0 0.1\n1 2 2 0 0 0 0.2\n", "no quaternion of length 1"},
           {"1357847248396800 1 2 3 0 0 0.5\n", "no quaternion of length 1"},
           // A quaternion that lies on its side in either order.
           {"1 2 3 0.5 0.5 0.5 0.5\n", "stand upright"},
           // Angles, whose order and unit nothing tells.
           {"x,y,z,roll,pitch,yaw\n1,2,3,0,0,0.5\n", "three angles, which are not read"},
           // The length of two stamps and a quaternion.
           {"1.5 2 1 2 3 0 0 0 1\n", "seconds and nanoseconds"},
           // Oxford's length without its headline.
           {"1,2,3,4,5,6,7,8,9,10,11,12,13,14,15\n", "headline"},
           {"1583836591 0.5 1 2 3 0 0 0 1\n", "seconds and nanoseconds"},
           {"1 2 3 0 0 0 1\n1 2 3 0 0 0 1 5\n", "poses.txt:2: has 8 values"},
           {"x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,3,0,0,0\n", "poses.txt:3: has 6 values"},
           {"x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,3,0,0,0,2\n", "poses.txt:3: "}}) {
    const auto read = Read(content);
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << content;
    EXPECT_THAT(std::string(read.status().message()), HasSubstr(reason)) << content;
  }
}

}  // namespace
}  // namespace scanloc::dataset
