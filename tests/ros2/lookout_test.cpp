// When scans are asked about, and what is told of the answers: without DDS, client and clock.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "ros2/lookout_fixture.hpp"

namespace scanloc::ros2 {
namespace {

using ::testing::HasSubstr;

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
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("not localized: not_recognized"));
  EXPECT_FALSE(Round(Localized(), 0).initial_pose.has_value());
  EXPECT_FALSE(lookout->IsDone(now_ns));
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("nobody subscribes"));
  EXPECT_FALSE(lookout->TakeListeners(1, now_ns).initial_pose.has_value()) << "it is old by now";
  const Told told = Round(Localized(At(7)), 1);
  EXPECT_TRUE(told.initial_pose->pose.isApprox(At(7)));
  EXPECT_TRUE(lookout->IsDone(now_ns));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kOk);
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
  EXPECT_THAT(lookout->Diagnose(now_ns).message,
              HasSubstr("localized before, now: not_recognized"));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kWarn);
  (void)Round(Missed());
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("lost again"));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kError);
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "localized");
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
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("no answer: no server at 127.0.0.1:1"));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kError);
  (void)Round(Localized());
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "localized");
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
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "waits for a trigger");
  lookout->TakeTrigger();
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
  Cloud(3);
  EXPECT_FALSE(Next().has_value()) << "it is localized";
  EXPECT_FALSE(lookout->IsDone(now_ns)) << "it stays for triggers";
  lookout->TakeTrigger();
  EXPECT_TRUE(Round(Localized()).initial_pose.has_value());
}

TEST_F(LookoutTest, AsksAboutNoCloudFromBeforeTheTrigger) {
  Begin({.mode = Mode::kUntilLocalized, .asks_at_start = false, .stays = true});
  Cloud(1);  // then the sensor is silent, and the robot carried elsewhere
  lookout->TakeTrigger();
  EXPECT_FALSE(Next().has_value());
  EXPECT_EQ(Value("clouds_passed_over"), "1");
  Cloud(9000);
  EXPECT_TRUE(Next().has_value());
}

TEST_F(LookoutTest, AsksAboutNoCloudOfLongAgo) {
  Begin({.mode = Mode::kUntilLocalized});
  Cloud(1);
  ASSERT_TRUE(Next().has_value());
  Cloud(2);
  now_ns += 60 * kSecond;  // then the sensor is silent while the server does not answer
  (void)Answer(absl::DeadlineExceededError("late"));
  now_ns = lookout->NextChange_ns();
  EXPECT_FALSE(Next().has_value());
  EXPECT_EQ(Value("clouds_passed_over"), "1");
  Cloud(62);
  EXPECT_TRUE(Next().has_value());
}

TEST_F(LookoutTest, SaysWhenCloudsNoLongerCome) {
  Begin({.mode = Mode::kAlways});
  (void)Round(Localized());
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "localized");
  now_ns += Lookout::kSilence_ns;
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kWarn);
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("no cloud has come for"));
  (void)Round(Localized());
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "localized");

  Begin({.mode = Mode::kUntilLocalized, .stays = true});
  (void)Round(Localized());
  now_ns += Lookout::kSilence_ns;
  EXPECT_EQ(lookout->Diagnose(now_ns).message, "localized") << "it needs none";
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

TEST_F(LookoutTest, RefusesACloudThatIsNoneAndTakesTheNext) {
  Begin({.mode = Mode::kOnce});
  static const std::string lie = test::LyingCloudBytes({.point_step = 0});
  lookout->TakeCloud({.bytes = lie}, now_ns);
  EXPECT_FALSE(Next().has_value());
  EXPECT_THAT(lookout->Diagnose(now_ns).message, HasSubstr("of the 0 bytes of a point"));
  EXPECT_EQ(lookout->Diagnose(now_ns).level, DiagnosticMessage::Level::kError);
  EXPECT_EQ(Value("clouds_refused"), "1");
  (void)Round(Localized());
  EXPECT_TRUE(lookout->IsDone(now_ns));
}

TEST_F(LookoutTest, TellsHowFarOffThePoseMayBe) {
  Begin({.mode = Mode::kOnce});
  auto reply = Localized();
  PoseCovariance covariance = PoseCovariance::Identity();
  covariance(0, 1) = covariance(1, 0) = 0.5;
  reply->reply.answer.candidates[0].covariance = covariance;
  EXPECT_EQ(Round(reply).pose->covariance, covariance);
}

}  // namespace
}  // namespace scanloc::ros2
