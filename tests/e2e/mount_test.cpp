// A sensor that hangs upside down, and one that sees its own robot.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "e2e/programs.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/dataset/pose_reader.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;

constexpr const char* kMount = "0.5,-0.1,1.2,180,0,0";

/// Drive 2 of Town() with the sensor hanging, and the poses of a base that it hangs on.
struct HangingDrive {
  TempDir dir;
  std::string scans = dir.File("hanging");
  std::string base_poses;

  HangingDrive() {
    MustScanloc({"simulate", scans, "--session-seed", "2", "--lane-shift-m", "1", "--town-seed",
                 "3", "--length-m", "60", "--rays", "16", "--azimuths", "360", "--spacing-m", "2",
                 "--mount-deg", "180,0,0", "--quiet"});
    SensorMount mount;
    mount.T_base_sensor = *MountPose({0.5, -0.1, 1.2}, {180.0, 0.0, 0.0});
    std::ostringstream rows;
    rows.precision(17);
    const auto driven = dataset::ReadTrajectory(scans + "/poses.txt");
    for (const Pose& pose : driven->T_map_sensor) {
      const Pose base = BaseOfSensor(mount, pose);
      for (int i = 0; i < 12; ++i) rows << base.matrix()(i / 4, i % 4) << (i < 11 ? " " : "\n");
    }
    base_poses = dir.Write("base.txt", rows.str());
  }
};

const HangingDrive& Hanging() {
  static const HangingDrive drive;
  return drive;
}

/// All answers are localized and right.
void ExpectAllRight(const json& document) {
  const json& summary = document.at("summary");
  EXPECT_EQ(summary.at("num_localized_right"), TinyTown::kNumScans) << summary.dump(2);
  EXPECT_EQ(summary.at("num_false"), 0);
}

TEST(MountOnTheCommandLine, LocatesTheBaseOfASensorThatHangs) {
  for (const Args& more : {Args{}, Args{"--sequence", "--odometry", Hanging().base_poses}}) {
    Args args = {
        "locate", Town().map1,       "--scans", Hanging().scans, "--truth", Hanging().base_poses,
        "--json", "--T-base-sensor", kMount,    "--quiet"};
    args.insert(args.end(), more.begin(), more.end());
    const json document = json::parse(MustScanloc(args));
    ExpectAllRight(document);
    EXPECT_LT(document.at("summary").at("median_error_m"), 0.2);
    EXPECT_NEAR(document.at("mount").at("T_base_sensor").at("qx"), 1.0, 1e-9);
  }
}

TEST(MountOnTheCommandLine, BuildsAMapOfPosesOfTheBase) {
  const TempDir dir;
  const std::string map = dir.File("map");
  MustScanloc({"build", map, "--scans", Hanging().scans, "--poses", Hanging().base_poses,
               "--T-base-sensor", kMount, "--spacing-m", "0", "--quiet"});
  // The map holds the sensor upright where it was, so that other robots are found in it.
  const json document = json::parse(MustScanloc(
      {"locate", map, "--scans", Town().drive1, "--truth", Town().Poses1(), "--json", "--quiet"}));
  ExpectAllRight(document);
  const json eval = json::parse(
      MustScanloc({"eval", map, "--scans", Hanging().scans, "--poses", Hanging().base_poses,
                   "--T-base-sensor", kMount, "--method", "auto,a-pc", "--json", "--quiet"}));
  EXPECT_EQ(eval.at("mount").at("min_range_m"), 0.0);
  for (const json& method : eval.at("results")) EXPECT_EQ(method.at("recall_at_1"), 1.0);
}

TEST(MountOnTheCommandLine, IsMissedByWhoBuildsAMapThatStandsOnItsHead) {
  const TempDir dir;
  const Args build = {"--scans", Hanging().scans, "--poses", Hanging().base_poses, "--spacing-m",
                      "0",       "--quiet"};
  Args untold = {"build", dir.File("untold")};
  untold.insert(untold.end(), build.begin(), build.end());
  EXPECT_THAT(Scanloc(untold).err, testing::HasSubstr("a sensor that hangs"));
  untold.push_back("--accept-inconsistent");
  EXPECT_THAT(MustScanloc(untold), testing::HasSubstr("180 deg off z"));
  Args told = {"build", dir.File("told"), "--T-base-sensor", kMount};
  told.insert(told.end(), build.begin(), build.end());
  EXPECT_THAT(MustScanloc(told), testing::Not(testing::HasSubstr("deg off z")));
}

TEST(MountOnTheCommandLine, LeavesOutWhatIsTheRobotItself) {
  // All there is: then nothing is left to look up.
  const json document = json::parse(
      MustScanloc({"locate", Town().map1, "--scans", Town().drive1, "--self-box",
                   "-500,-500,-500,500,500,500", "--min-range-m", "1.5", "--json", "--quiet"}));
  EXPECT_EQ(document.at("summary").at("num_insufficient"), TinyTown::kNumScans);
  EXPECT_EQ(document.at("mount").at("min_range_m"), 1.5);
  EXPECT_EQ(document.at("mount").at("self_box"), json({-500, -500, -500, 500, 500, 500}));
}

}  // namespace
}  // namespace scanloc::test
