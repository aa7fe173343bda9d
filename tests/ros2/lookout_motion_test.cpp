// How a moving robot is followed: mounts, odometry and transforms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ros2/lookout_fixture.hpp"

namespace scanloc::ros2 {
namespace {

using ::testing::HasSubstr;

TEST_F(LookoutTest, TellsHowFarTheRobotWentSinceTheScanAnsweredLast) {
  const Pose T_base_sensor = At(1, 0, 0.5);
  Begin({.mode = Mode::kAlways,
         .mount = {.T_base_sensor = T_base_sensor, .min_range_m = 1.5},
         .knows_base = true,
         .interval_s = 0.0});
  (void)Odom(0, At(0));
  (void)Odom(1, At(10, 0, 0.2));
  (void)Odom(2, At(20, 4, 0.4));
  Cloud(1);
  const auto first = Next();
  ASSERT_TRUE(first.has_value());
  EXPECT_FALSE(first->T_last_scan.has_value());
  EXPECT_TRUE(first->mount.T_base_sensor.isApprox(T_base_sensor));
  EXPECT_EQ(first->mount.min_range_m, 1.5);
  const Told told = Answer(Localized(At(100)));
  EXPECT_TRUE(told.pose->pose.isApprox(At(100), 1e-9));
  EXPECT_TRUE(told.candidates->poses.at(0).isApprox(At(100), 1e-9));
  Cloud(2);
  const auto second = Next();
  ASSERT_TRUE(second.has_value());
  ASSERT_TRUE(second->T_last_scan.has_value());
  const Pose moved = At(10, 0, 0.2).inverse() * At(20, 4, 0.4);
  EXPECT_TRUE(second->T_last_scan->isApprox(moved, 1e-9)) << "the base has";
}

TEST_F(LookoutTest, LearnsTheMountFromStaticTransforms) {
  Begin({.mode = Mode::kOnce});
  cloud_frame = "lidar";
  Cloud(1);
  EXPECT_FALSE(Next().has_value()) << "it waits for them";
  EXPECT_EQ(lookout->NextChange_ns(), now_ns + Lookout::kMountWait_ns);
  lookout->TakeStaticTransform({.parent = "base_link", .child = "mast", .T_parent_child = At(1)});
  lookout->TakeStaticTransform({.parent = "mast", .child = "lidar", .T_parent_child = At(0, 2)});
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_TRUE(question->mount.T_base_sensor.isApprox(At(1, 2), 1e-9));
}

TEST_F(LookoutTest, LearnsTheMountAfterOthersWereToldAgainAndAgain) {
  Begin({.mode = Mode::kOnce});
  for (std::size_t i = 0; i < Lookout::kMaxStaticFrames; ++i) {
    lookout->TakeStaticTransform(
        {.parent = "base_link", .child = "camera", .T_parent_child = At(2)});
  }
  lookout->TakeStaticTransform({.parent = "base_link", .child = "lidar", .T_parent_child = At(1)});
  cloud_frame = "lidar";
  Cloud(1);
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_TRUE(question->mount.T_base_sensor.isApprox(At(1), 1e-9));
}

TEST_F(LookoutTest, TellsOfTheSensorWhereNoMountIsKnown) {
  Begin({.mode = Mode::kOnce});
  cloud_frame = "lidar";
  lookout->TakeStaticTransform({.parent = "lidar", .child = "lidar", .T_parent_child = At(1)});
  Cloud(1);
  EXPECT_FALSE(Next().has_value());
  now_ns += Lookout::kMountWait_ns;
  ASSERT_TRUE(Next().has_value());
  EXPECT_TRUE(Answer(Localized(At(7))).pose->pose.isApprox(At(7), 1e-9));
  (void)lookout->TakeListeners(1, now_ns);
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("no mount of \"lidar\" is known"));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kWarn);
}

TEST_F(LookoutTest, RefusesCloudsThatDoNotMoveWithTheRobot) {
  Begin({.mode = Mode::kOnce});
  cloud_frame = "camera_init";
  Cloud(1);
  EXPECT_FALSE(Next().has_value()) << "it waits for the mount";
  (void)lookout->TakeOdometry({kStart_ns, "camera_init", "body", At(10)});
  now_ns += Lookout::kMountWait_ns;
  EXPECT_FALSE(Next().has_value()) << "it would tell where the odometry began";
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("it is in \"camera_init\", which does"));
  EXPECT_EQ(Value("clouds_refused"), "1");
  cloud_frame = "map";
  Cloud(2);
  EXPECT_FALSE(Next().has_value());
  cloud_frame = "base_link";
  Cloud(3);
  EXPECT_TRUE(Next().has_value());
}

TEST_F(LookoutTest, UsesNoOdometryOfTheBaseForASensorThatNothingTiesToIt) {
  Begin({.mode = Mode::kAlways, .publishes_tf = true, .interval_s = 0.0});
  cloud_frame = "lidar";
  for (int i = 9; i < 23; ++i) (void)Odom(0.1 * i, At(0.2 * i));
  const PointCloud wall = {{10, 0, 0}, {9, 0, 0}};
  Cloud(1, wall, {0.0F, 0.1F});
  EXPECT_FALSE(Next().has_value()) << "it waits for the mount";
  now_ns += Lookout::kMountWait_ns;
  for (const double at_s : {1.0, 2.0}) {
    if (at_s > 1.0) Cloud(at_s, wall, {0.0F, 0.1F});
    const auto question = Next();
    ASSERT_TRUE(question.has_value());
    EXPECT_EQ(question->scan, wall) << "which way the sensor goes is not known";
    EXPECT_FALSE(question->T_last_scan.has_value());
    (void)Answer(Localized(At(7)));
  }
  EXPECT_FALSE(Odom(2.3, At(4.6)).map_odom.has_value()) << "off by where the sensor sits";
}

TEST_F(LookoutTest, TakesOdometryOfAnotherFrameOfTheRobot) {
  Begin({.mode = Mode::kAlways, .publishes_tf = true});
  lookout->TakeStaticTransform({.parent = "base_link", .child = "imu", .T_parent_child = At(2)});
  (void)lookout->TakeOdometry({kStart_ns, "odom", "imu", At(10)});
  Cloud(0);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized(At(108)));  // base_link is at 8 in odom
  const Told told = lookout->TakeOdometry({kStart_ns + kSecond, "odom", "imu", At(11)});
  EXPECT_TRUE(told.map_odom->T_parent_child.isApprox(At(100), 1e-9));
}

TEST_F(LookoutTest, LeavesOutOdometryOfABodyThatNothingConnectsWithTheBase) {
  Begin({.mode = Mode::kAlways, .publishes_tf = true, .interval_s = 0.0});
  const auto odometry = [&](double at_s, double x) {
    const auto stamp_ns = kStart_ns + static_cast<std::int64_t>(at_s * 1e9);
    return lookout->TakeOdometry({stamp_ns, "odom", "imu", At(x)});
  };
  (void)odometry(0, 10);
  Cloud(0);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized(At(108)));
  EXPECT_FALSE(odometry(1, 11).map_odom.has_value()) << "it would be off by where the imu sits";
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("odometry is of \"imu\" and left out"));

  lookout->TakeStaticTransform({.parent = "base_link", .child = "imu", .T_parent_child = At(2)});
  (void)odometry(2, 11);
  Cloud(2);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized(At(109)));  // base_link is at 9 in odom
  EXPECT_TRUE(odometry(3, 12).map_odom->T_parent_child.isApprox(At(100), 1e-9));
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("localized"));
}

TEST_F(LookoutTest, WaitsALittleForOdometryOfTheScansTime) {
  Begin({.mode = Mode::kAlways, .interval_s = 0.0, .odometry_wait_s = 0.1});
  (void)Odom(0.9, At(0));
  Cloud(1);
  EXPECT_FALSE(Next().has_value());
  EXPECT_EQ(lookout->NextChange_ns(), now_ns + 100 * kMs);
  (void)Odom(1.1, At(1));
  EXPECT_TRUE(Next().has_value());
  (void)Answer(Localized());
  Cloud(2);
  EXPECT_FALSE(Next().has_value());
  now_ns += 100 * kMs;
  const auto question = Next();
  ASSERT_TRUE(question.has_value()) << "without odometry rather than not at all";
  EXPECT_FALSE(question->T_last_scan.has_value());
  EXPECT_EQ(Value("clouds_without_odometry"), "1");
}

TEST_F(LookoutTest, TakesMotionOutOfASweepOnceItsEndIsKnown) {
  const PointCloud wall = {{10, 0, 0}, {9.5F, 0, 0}, {9, 0, 0}};  // 10 m/s towards it
  const std::vector<float> times_s = {0.0F, 0.05F, 0.1F};
  for (const bool deskews : {true, false}) {
    Begin({.mode = Mode::kOnce, .deskews = deskews});
    (void)Odom(0.9, At(0));
    (void)Odom(1.05, At(1.5));
    Cloud(1, wall, times_s);
    EXPECT_EQ(Next().has_value(), !deskews) << "it waits for odometry of the last point";
    if (!deskews) continue;
    (void)Odom(1.2, At(3));
    const auto question = Next();
    ASSERT_TRUE(question.has_value());
    for (const Point& point : question->scan) EXPECT_NEAR(point.x, 10.0F, 0.01F);
    EXPECT_EQ(Value("clouds_deskewed"), "1");
  }
}

TEST_F(LookoutTest, AsksAboutASweepAsItIsWhereItsMotionIsNotKnown) {
  Begin({.mode = Mode::kOnce});
  (void)Odom(0.9, At(0));
  (void)Odom(1.05, At(1.5));
  const PointCloud wall = {{10, 0, 0}, {9, 0, 0}};
  Cloud(1, wall, {0.0F, 0.1F});
  EXPECT_FALSE(Next().has_value());
  now_ns += 100 * kMs;
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_EQ(question->scan, wall);
  EXPECT_EQ(Value("clouds_deskewed"), "0");
}

TEST_F(LookoutTest, BeginsAnewWhenTimeDoes) {
  Begin({.mode = Mode::kAlways, .interval_s = 0.0});
  (void)Odom(0, At(0));
  (void)Odom(9, At(1));
  Cloud(8);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized());
  (void)Odom(0, At(0));
  (void)Odom(9, At(1));
  Cloud(2);
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_TRUE(question->begins_anew);
  EXPECT_FALSE(question->T_last_scan.has_value());
}

TEST_F(LookoutTest, PublishesMapToOdomWhileLocalizedAndIsSilentWhenLost) {
  Begin({.mode = Mode::kAlways,
         .stays = true,
         .publishes_tf = true,
         .interval_s = 0.0,
         .num_misses_to_lost = 1});
  EXPECT_FALSE(Odom(0, At(0)).map_odom.has_value());
  (void)Odom(1, At(10));
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized(At(110)));
  const Told told = Odom(2, At(20));
  ASSERT_TRUE(told.map_odom.has_value());
  EXPECT_EQ(told.map_odom->parent, "map");
  EXPECT_EQ(told.map_odom->child, "odom");
  EXPECT_EQ(told.map_odom->stamp_ns, kStart_ns + 2 * kSecond);
  EXPECT_TRUE(told.map_odom->T_parent_child.isApprox(At(100), 1e-9));
  Cloud(2);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Missed());
  EXPECT_FALSE(Odom(3, At(30)).map_odom.has_value());
}

TEST_F(LookoutTest, IsSilentFromALeapOfOdometryUntilTheRobotIsFound) {
  BeginLocalized({.mode = Mode::kUntilLocalized, .stays = true, .publishes_tf = true});
  EXPECT_TRUE(Odom(1.1, At(19)).map_odom.has_value()) << "90 m/s";
  EXPECT_FALSE(Odom(1.2, At(0)).map_odom.has_value()) << "odometry began anew";
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "lost again: odometry leapt");

  Cloud(1.2);
  now_ns += 2 * kSecond;
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_TRUE(question->begins_anew);
  (void)Odom(1.3, At(50));  // once more, before the answer
  (void)Answer(Localized(At(119)));
  EXPECT_FALSE(Odom(1.4, At(50)).map_odom.has_value()) << "the answer is of before";
  Cloud(1.4);
  now_ns += 2 * kSecond;
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized(At(120)));
  const Told told = Odom(1.5, At(51));
  ASSERT_TRUE(told.map_odom.has_value());
  EXPECT_TRUE(told.map_odom->T_parent_child.isApprox(At(70), 1e-9));
}

TEST_F(LookoutTest, IsSilentFromOdometryOfAnotherFrameUntilTheRobotIsFound) {
  BeginLocalized({.mode = Mode::kUntilLocalized, .stays = true, .publishes_tf = true});
  const auto other = lookout->TakeOdometry({kStart_ns + 1100 * kMs, "visual", "base_link", At(10)});
  EXPECT_FALSE(other.map_odom.has_value()) << "the map was told to lie in odom";
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "lost again: odometry leapt");
}

TEST_F(LookoutTest, ForgetsWhereOdometryLiesWhenTheRobotWasCarriedOff) {
  BeginLocalized({.mode = Mode::kAlways, .publishes_tf = true, .interval_s = 0.0});
  EXPECT_TRUE(Odom(2, At(10)).map_odom.has_value());
  Cloud(50);  // of a time without odometry
  EXPECT_FALSE(Next().has_value());
  now_ns += 100 * kMs;
  ASSERT_TRUE(Next().has_value());
  auto relocated = Localized(At(500));
  relocated->is_relocated = true;
  (void)Answer(relocated);
  EXPECT_FALSE(Odom(3, At(10)).map_odom.has_value()) << "it would put the robot where it was";
}

TEST_F(LookoutTest, GoesOnUntilThereIsATransform) {
  Begin({.mode = Mode::kUntilLocalized, .stays = true, .publishes_tf = true});
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("no transform without odometry"));
  (void)Odom(4, At(0));
  (void)Odom(5, At(1));
  Cloud(5);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized());
  EXPECT_TRUE(Odom(6, At(2)).map_odom.has_value());
  Cloud(6);
  now_ns += 2 * kSecond;
  EXPECT_FALSE(Next().has_value());
}

TEST_F(LookoutTest, PublishesNoTransformFromAFrameToItselfOrToNone) {
  for (const char* const frame : {"map", ""}) {
    Begin({.mode = Mode::kAlways, .publishes_tf = true, .interval_s = 0.0});
    const auto odometry = [&](int at_s) {
      return lookout->TakeOdometry({kStart_ns + at_s * kSecond, frame, "base_link", At(at_s)});
    };
    (void)odometry(1);
    (void)odometry(2);
    Cloud(1);
    ASSERT_TRUE(Next().has_value());
    (void)Answer(Localized());
    EXPECT_FALSE(odometry(3).map_odom.has_value()) << frame;
    EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("--odom-frame"));
    EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kWarn);
  }
}

TEST(Odometry, KeepsTheLastSecondsOnly) {
  Odometry odometry;
  for (int i = 0; i < 100'000; ++i) {
    odometry.Add({.stamp_ns = kStart_ns + i * 10 * kMs, .T_parent_child = At(i)});
  }
  EXPECT_FALSE(odometry.At(kStart_ns + 900 * kSecond).has_value());
  EXPECT_TRUE(odometry.At(kStart_ns + 995 * kSecond)->isApprox(At(99'500)));
  odometry.Add({.stamp_ns = kStart_ns, .T_parent_child = At(1)});
  EXPECT_FALSE(odometry.At(kStart_ns + 995 * kSecond).has_value()) << "time began anew";
}

}  // namespace
}  // namespace scanloc::ros2
