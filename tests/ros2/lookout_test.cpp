// When scans are asked about, and what is told of the answers: without DDS, client and clock.
#include "lookout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "ros2/ros_wire.hpp"

namespace scanloc::ros2 {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000 * kMs;
constexpr std::int64_t kStart_ns = 1'700'000'000 * kSecond;

Pose At(double x, double y = 0.0, double yaw_rad = 0.0) {
  return Eigen::Translation3d(x, y, 0) * Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
}

absl::StatusOr<TrackedReply> Reply(Outcome outcome, const Pose& T_map_query = At(5)) {
  TrackedReply reply{.reply = {.map = "town"}};
  reply.reply.answer.outcome = outcome;
  reply.reply.answer.candidates.push_back({.confidence = 0.99, .T_map_query = T_map_query});
  return reply;
}
absl::StatusOr<TrackedReply> Localized(const Pose& T_map_query = At(5)) {
  return Reply(Outcome::kLocalized, T_map_query);
}
absl::StatusOr<TrackedReply> Missed() { return Reply(Outcome::kNotRecognized); }

class LookoutTest : public ::testing::Test {
 protected:
  void Begin(const LookoutOptions& options) { lookout.emplace(options); }

  /// A cloud of one point whose x is the stamp, in seconds since the start.
  void Cloud(double at_s) {
    auto bytes = std::make_shared<const std::string>(
        test::CloudBytes({{static_cast<float>(at_s), 0, 0}},
                         kStart_ns + static_cast<std::int64_t>(at_s * 1e9), cloud_frame));
    const std::string_view view = *bytes;
    lookout->TakeCloud({.bytes = view, .owner = std::move(bytes)});
  }
  Told Odom(double at_s, const Pose& T_odom_base) {
    return lookout->TakeOdometry({.stamp_ns = kStart_ns + static_cast<std::int64_t>(at_s * 1e9),
                                  .parent = "odom",
                                  .child = "base_link",
                                  .T_parent_child = T_odom_base});
  }
  std::optional<Question> Next() { return lookout->NextQuestion(now_ns); }
  Told Answer(const absl::StatusOr<TrackedReply>& reply) {
    return lookout->TakeReply(reply, now_ns);
  }
  /// A cloud comes, is asked about and answered, with so many listeners; then so much time goes by.
  Told Round(const absl::StatusOr<TrackedReply>& reply, std::size_t num_listeners = 1) {
    Cloud(1e-9 * static_cast<double>(now_ns));
    EXPECT_TRUE(Next().has_value());
    Told told = Answer(reply);
    told.initial_pose = lookout->TakeListeners(num_listeners, now_ns).initial_pose;
    now_ns += 2 * kSecond;
    return told;
  }
  std::string Value(const std::string& key) {
    for (const auto& [name, value] : lookout->Diagnose().values) {
      if (name == key) return value;
    }
    return "none";
  }

  std::optional<Lookout> lookout;
  std::string cloud_frame = "base_link";
  std::int64_t now_ns = 100 * kSecond;
};

TEST_F(LookoutTest, AsksAboutTheNewestScanAndCountsThosePassedOver) {
  Begin({.mode = Mode::kAlways, .interval_s = 0.0});
  EXPECT_FALSE(Next().has_value());
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  for (const double at_s : {2, 3, 4}) Cloud(at_s);
  EXPECT_FALSE(Next().has_value()) << "one question at a time";
  (void)Answer(Localized());
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_EQ(question->scan, (PointCloud{{4, 0, 0}}));
  EXPECT_EQ(Value("clouds_received"), "4");
  EXPECT_EQ(Value("clouds_passed_over"), "2");
  EXPECT_EQ(Value("clouds_asked"), "2");
}

TEST_F(LookoutTest, OnceEndsWithAnAnswerWhateverItSays) {
  Begin({.mode = Mode::kOnce});
  EXPECT_FALSE(lookout->IsDone(now_ns));
  const Told told = Round(Missed());
  EXPECT_TRUE(lookout->IsDone(now_ns));
  EXPECT_FALSE(told.pose.has_value());
  EXPECT_FALSE(told.initial_pose.has_value());
  EXPECT_EQ(told.candidates->poses.size(), 1U);
  Cloud(9);
  EXPECT_FALSE(Next().has_value());
}

TEST_F(LookoutTest, OnceKeepsThePoseAWhileForWhoIsNotThereYet) {
  Begin({.mode = Mode::kOnce});
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized());
  EXPECT_FALSE(lookout->TakeListeners(0, now_ns).initial_pose.has_value());
  EXPECT_FALSE(lookout->IsDone(now_ns));
  EXPECT_EQ(lookout->NextChange_ns(), now_ns + Lookout::kUnheard_ns);
  EXPECT_TRUE(lookout->TakeListeners(1, now_ns + kSecond).initial_pose.has_value());
  EXPECT_TRUE(lookout->IsDone(now_ns + kSecond));
}

TEST_F(LookoutTest, UntilLocalizedGoesOnUntilSomebodyWasTold) {
  Begin({.mode = Mode::kUntilLocalized});
  (void)Round(Missed());
  EXPECT_FALSE(lookout->IsDone(now_ns));
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("not localized: not_recognized"));
  EXPECT_FALSE(Round(Localized(), 0).initial_pose.has_value());
  EXPECT_FALSE(lookout->IsDone(now_ns));
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("nobody subscribes"));
  EXPECT_FALSE(lookout->TakeListeners(1, now_ns).initial_pose.has_value()) << "it is old by now";
  const Told told = Round(Localized(At(7)), 1);
  EXPECT_TRUE(told.initial_pose->pose.isApprox(At(7)));
  EXPECT_TRUE(lookout->IsDone(now_ns));
  EXPECT_EQ(lookout->Diagnose().level, DiagnosticMessage::Level::kOk);
}

TEST_F(LookoutTest, AlwaysTellsTheInitialPoseOnceAndThePoseEveryTime) {
  Begin({.mode = Mode::kAlways});
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  const Told told = Round(Localized(At(6)));
  EXPECT_FALSE(told.initial_pose.has_value());
  EXPECT_TRUE(told.pose->pose.isApprox(At(6)));
  EXPECT_EQ(told.pose->frame, "map");
  auto relocated = Localized(At(50));
  relocated->is_relocated = true;
  EXPECT_TRUE(Round(relocated).initial_pose.has_value()) << "it was carried off";
  EXPECT_FALSE(lookout->IsDone(now_ns));
}

TEST_F(LookoutTest, SaysWhenTheRobotIsLostAgainAndFindsItAnew) {
  Begin({.mode = Mode::kAlways, .num_misses_to_lost = 2});
  (void)Round(Localized());
  (void)Round(Missed());
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("localized before, now: not_recognized"));
  EXPECT_EQ(lookout->Diagnose().level, DiagnosticMessage::Level::kWarn);
  (void)Round(Missed());
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("lost again"));
  EXPECT_EQ(lookout->Diagnose().level, DiagnosticMessage::Level::kError);
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  EXPECT_EQ(lookout->Diagnose().message, "localized");
}

TEST_F(LookoutTest, AsksLessOftenWhileLocalized) {
  Begin({.mode = Mode::kAlways, .interval_s = 1.0});
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(Localized());
  Cloud(2);
  EXPECT_FALSE(Next().has_value());
  EXPECT_EQ(lookout->NextChange_ns(), now_ns + kSecond);
  now_ns += kSecond;
  EXPECT_TRUE(Next().has_value());
  (void)Answer(Missed());
  Cloud(3);
  now_ns += Lookout::kSearchInterval_ns;
  EXPECT_TRUE(Next().has_value());
}

TEST_F(LookoutTest, ComesBackLaterAndLaterWhileNobodyAnswers) {
  Begin({.mode = Mode::kUntilLocalized});
  std::int64_t waited_ns = 0;
  for (int i = 0; i < 8; ++i) {
    Cloud(1 + i);
    const auto question = Next();
    ASSERT_TRUE(question.has_value());
    EXPECT_TRUE(question->begins_anew);
    (void)Answer(absl::UnavailableError("no server at 127.0.0.1:1"));
    Cloud(1.5 + i);
    const std::int64_t next_ns = lookout->NextChange_ns();
    EXPECT_GE(next_ns - now_ns, waited_ns);
    waited_ns = next_ns - now_ns;
    now_ns = next_ns;
  }
  EXPECT_LE(waited_ns, 5 * kSecond);
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("no answer: no server at 127.0.0.1:1"));
  EXPECT_EQ(lookout->Diagnose().level, DiagnosticMessage::Level::kError);
  (void)Round(Localized());
  EXPECT_EQ(lookout->Diagnose().message, "localized");
}

TEST_F(LookoutTest, OnceFailsWhereAnotherTryWouldFailToo) {
  Begin({.mode = Mode::kOnce});
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(absl::UnavailableError("away"));
  EXPECT_TRUE(lookout->failure().ok());
  now_ns += kSecond;
  Cloud(2);
  ASSERT_TRUE(Next().has_value());
  (void)Answer(absl::NotFoundError("no map is named x"));
  EXPECT_TRUE(lookout->IsDone(now_ns));
  EXPECT_EQ(lookout->failure().message(), "no map is named x");
}

TEST_F(LookoutTest, WaitsForTheTriggerAndBeginsAnewWithEach) {
  Begin({.mode = Mode::kUntilLocalized, .asks_at_start = false, .stays = true});
  Cloud(1);
  EXPECT_FALSE(Next().has_value());
  EXPECT_EQ(lookout->Diagnose().message, "waits for a trigger");
  lookout->TakeTrigger();
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  Cloud(3);
  EXPECT_FALSE(Next().has_value()) << "it is localized";
  EXPECT_FALSE(lookout->IsDone(now_ns)) << "it stays for triggers";
  lookout->TakeTrigger();
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
}

TEST_F(LookoutTest, LeavesOutAReplyFromBeforeTheTrigger) {
  Begin({.mode = Mode::kAlways, .stays = true});
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  lookout->TakeTrigger();
  EXPECT_FALSE(Answer(Localized()).pose.has_value());
  Cloud(2);
  const auto question = Next();
  ASSERT_TRUE(question.has_value());
  EXPECT_TRUE(question->begins_anew);
}

TEST_F(LookoutTest, TellsHowFarTheRobotWentSinceTheScanAnsweredLast) {
  const Pose T_base_sensor = At(1, 0, 0.5);
  Begin({.mode = Mode::kAlways, .T_base_sensor = T_base_sensor, .interval_s = 0.0});
  (void)Odom(0, At(0));
  (void)Odom(1, At(10, 0, 0.2));
  (void)Odom(2, At(20, 4, 0.4));
  Cloud(1);
  const auto first = Next();
  ASSERT_TRUE(first.has_value());
  EXPECT_FALSE(first->T_last_scan.has_value());
  const Told told = Answer(Localized(At(100) * T_base_sensor));
  EXPECT_TRUE(told.pose->pose.isApprox(At(100), 1e-9)) << "told of the base";
  EXPECT_TRUE(told.candidates->poses.at(0).isApprox(At(100), 1e-9));
  Cloud(2);
  const auto second = Next();
  ASSERT_TRUE(second.has_value());
  ASSERT_TRUE(second->T_last_scan.has_value());
  const Pose moved = (At(10, 0, 0.2) * T_base_sensor).inverse() * At(20, 4, 0.4) * T_base_sensor;
  EXPECT_TRUE(second->T_last_scan->isApprox(moved, 1e-9));
}

TEST_F(LookoutTest, LearnsTheMountFromStaticTransforms) {
  Begin({.mode = Mode::kOnce});
  cloud_frame = "lidar";
  Cloud(1);
  EXPECT_FALSE(Next().has_value()) << "it waits for them";
  EXPECT_EQ(lookout->NextChange_ns(), now_ns + Lookout::kMountWait_ns);
  lookout->TakeStaticTransform({.parent = "base_link", .child = "mast", .T_parent_child = At(1)});
  lookout->TakeStaticTransform({.parent = "mast", .child = "lidar", .T_parent_child = At(0, 2)});
  ASSERT_TRUE(Next().has_value());
  EXPECT_TRUE(Answer(Localized(At(101, 2))).pose->pose.isApprox(At(100), 1e-9));
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
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("no mount is known"));
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

TEST_F(LookoutTest, RefusesACloudThatIsNoneAndTakesTheNext) {
  Begin({.mode = Mode::kOnce});
  static const std::string lie = test::LyingCloudBytes({.point_step = 0});
  lookout->TakeCloud({.bytes = lie});
  EXPECT_FALSE(Next().has_value());
  EXPECT_THAT(lookout->Diagnose().message, HasSubstr("of the 0 bytes of a point"));
  EXPECT_EQ(lookout->Diagnose().level, DiagnosticMessage::Level::kError);
  EXPECT_EQ(Value("clouds_refused"), "1");
  (void)Round(Localized());
  EXPECT_TRUE(lookout->IsDone(now_ns));
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
