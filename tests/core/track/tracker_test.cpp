#include "scanloc/core/track/tracker.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/building.hpp"
#include "support/post_world.hpp"
#include "support/same_answer.hpp"

namespace scanloc {
namespace {

using test::Offset;
using test::PostWorld;

/// A robot that goes from place to place of a world, a little beside each.
class Robot {
 public:
  explicit Robot(const PostWorld& world, TrackerOptions options = {})
      : world_(world), tracker_(*Tracker::Create(world.localizer, options)) {}

  /// Drives there, reckoning well.
  TrackedAnswer DriveTo(std::int32_t place, const SearchControl& control = {}) {
    const Pose T_map_robot = PoseAt(place);
    const Pose T_last = T_map_robot_.inverse() * T_map_robot;
    T_map_robot_ = T_map_robot;
    return *tracker_.Update(world_.Seen(place, kBeside), T_last, control);
  }
  /// Is carried there and does not know.
  TrackedAnswer IsCarriedTo(std::int32_t place) {
    T_map_robot_ = PoseAt(place);
    return *tracker_.Update(world_.Seen(place, kBeside), Pose::Identity());
  }
  /// Gets there by a way that its odometry tells as half of what it is.
  TrackedAnswer DriftsTo(std::int32_t place) {
    const Pose T_map_robot = PoseAt(place);
    Pose T_last = T_map_robot_.inverse() * T_map_robot;
    T_last.translation() *= 0.5;
    T_map_robot_ = T_map_robot;
    return *tracker_.Update(world_.Seen(place, kBeside), T_last);
  }
  /// Goes on without odometry.
  TrackedAnswer Look(std::int32_t place) {
    T_map_robot_ = PoseAt(place);
    return *tracker_.Update(world_.Seen(place, kBeside));
  }
  Tracker& tracker() { return tracker_; }

 private:
  inline static const Pose kBeside = Offset(0.4, 0.6, 0.0, 0.1);
  [[nodiscard]] Pose PoseAt(std::int32_t place) const {
    return world_.localizer->map().places[static_cast<std::size_t>(place)].T_map_place * kBeside;
  }

  const PostWorld& world_;
  Tracker tracker_;
  Pose T_map_robot_ = Pose::Identity();
};

TEST(Tracker, TellsHowManyScansAnAnswerRestsOn) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  Robot robot(world);
  for (std::int32_t place = 0; place < 6; ++place) {
    const TrackedAnswer told = robot.DriveTo(place);
    ASSERT_EQ(told.answer.outcome, Outcome::kLocalized) << told.answer.reason;
    EXPECT_EQ(told.answer.candidates.front().place, place);
    EXPECT_EQ(told.num_scans, place + 1);
    EXPECT_FALSE(told.is_relocated);
    EXPECT_EQ(told.answer.content_id, "posts");
  }
}

// Places 1 and 4 are twins; what comes after them is not.
TEST(Tracker, TellsTwinsApartWhenTheRobotDrivesOn) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  for (const auto& [from, to] : {std::pair(1, 2), std::pair(4, 5), std::pair(1, 0)}) {
    Robot robot(world);
    const TrackedAnswer before = robot.DriveTo(from);
    EXPECT_EQ(before.answer.outcome, Outcome::kAmbiguous) << before.answer.reason;
    const TrackedAnswer after = robot.DriveTo(to);
    ASSERT_EQ(after.answer.outcome, Outcome::kLocalized) << after.answer.reason;
    EXPECT_EQ(after.answer.candidates.front().place, to);
    EXPECT_EQ(after.num_scans, 2);
    EXPECT_FALSE(after.is_relocated);
  }
}

TEST(Tracker, RemembersWhichTwinItIsAt) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  Robot robot(world);
  (void)robot.DriveTo(0);
  const TrackedAnswer told = robot.DriveTo(1);
  ASSERT_EQ(told.answer.outcome, Outcome::kLocalized) << told.answer.reason;
  EXPECT_EQ(told.answer.candidates.front().place, 1);
}

/// Two alike floors of three places each, 4 m apart; the upper one is entered past a place that has
/// no like.
class AlikeFloors {
 public:
  AlikeFloors() {
    for (const double height_m : {0.0, 4.0}) {
      for (int x = 1; x <= 3; ++x) Add(x, At(x, height_m));
    }
    Add(9, At(0, 4.0));
    localizer_ = building_.Open();
  }
  static Pose At(int x, double height_m) {
    return test::Offset(40.0 * x, 2.0 * x, height_m, 0.1 * x);
  }
  /// What is seen at a place: 0 is the entry; 1 to 3 look alike on both floors.
  [[nodiscard]] ScanDescriptor Seen(int x) { return building_.Describe(Scene(x == 0 ? 9 : x)); }
  [[nodiscard]] std::shared_ptr<const Localizer> localizer() const { return localizer_; }

 private:
  static PointCloud Scene(int scene) {
    return scenes::PostScan(static_cast<std::uint64_t>(scene), 70);
  }
  void Add(int scene, const Pose& pose) { building_.Add(Scene(scene), pose); }

  test::Building building_;
  std::shared_ptr<const Localizer> localizer_;
};

TEST(Tracker, StaysAmbiguousOnAlikeFloorsHoweverFarItGoes) {
  AlikeFloors floors;
  auto tracker = *Tracker::Create(floors.localizer(), {.query = {.max_answers = 2}});
  Pose T_map_last = AlikeFloors::At(1, 4.0);
  for (const int x : {1, 2, 3, 2, 1, 2, 3, 2, 1}) {
    const Pose T_map_robot = AlikeFloors::At(x, 4.0);
    const TrackedAnswer told =
        *tracker.Update(floors.Seen(x), Pose(T_map_last.inverse() * T_map_robot));
    T_map_last = T_map_robot;
    EXPECT_EQ(told.answer.outcome, Outcome::kAmbiguous) << told.answer.reason;
    EXPECT_EQ(told.answer.candidates.size(), 2U);
  }
}

TEST(Tracker, KnowsItsFloorByTheWayIn) {
  AlikeFloors floors;
  auto tracker = *Tracker::Create(floors.localizer());
  Pose T_map_last = AlikeFloors::At(0, 4.0);
  for (const int x : {0, 1, 2, 3, 2, 1, 2, 3}) {
    const Pose T_map_robot = AlikeFloors::At(x, 4.0);
    const TrackedAnswer told =
        *tracker.Update(floors.Seen(x), Pose(T_map_last.inverse() * T_map_robot));
    T_map_last = T_map_robot;
    ASSERT_EQ(told.answer.outcome, Outcome::kLocalized) << x << ": " << told.answer.reason;
    EXPECT_NEAR(told.answer.candidates.front().T_map_query.translation().z(), 4.0, 0.3);
  }
}

TEST(Tracker, IsNotSureOfItsFloorAfterALift) {
  AlikeFloors floors;
  auto tracker = *Tracker::Create(floors.localizer());
  const Pose T_1_2 = AlikeFloors::At(1, 4.0).inverse() * AlikeFloors::At(2, 4.0);
  (void)*tracker.Update(floors.Seen(0));
  const TrackedAnswer before = *tracker.Update(
      floors.Seen(1), Pose(AlikeFloors::At(0, 4.0).inverse() * AlikeFloors::At(1, 4.0)));
  ASSERT_EQ(before.answer.outcome, Outcome::kLocalized) << before.answer.reason;
  // In the cabin next to nothing is seen, and the robot reckons that it did not move.
  (void)*tracker.Update(Describer::Create(Params{})->Describe(scenes::PostScan(5, 3)),
                        Pose::Identity());
  const TrackedAnswer after = *tracker.Update(floors.Seen(1), Pose::Identity());
  EXPECT_EQ(after.answer.outcome, Outcome::kAmbiguous) << after.answer.reason;
  const TrackedAnswer further = *tracker.Update(floors.Seen(2), T_1_2);
  EXPECT_EQ(further.answer.outcome, Outcome::kAmbiguous) << further.answer.reason;
}

TEST(Tracker, FindsARobotThatWasCarriedOffWhileItStood) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  Robot robot(world);
  for (const std::int32_t place : {0, 1, 2}) (void)robot.DriveTo(place);
  const TrackedAnswer in_doubt = robot.IsCarriedTo(5);
  EXPECT_NE(in_doubt.answer.outcome, Outcome::kLocalized) << in_doubt.answer.reason;
  const TrackedAnswer found = robot.IsCarriedTo(5);
  ASSERT_EQ(found.answer.outcome, Outcome::kLocalized) << found.answer.reason;
  EXPECT_EQ(found.answer.candidates.front().place, 5);
  EXPECT_TRUE(found.is_relocated);
  EXPECT_EQ(found.num_scans, 2);
  const TrackedAnswer next = robot.DriveTo(4);
  EXPECT_EQ(next.answer.candidates.front().place, 4);
  EXPECT_FALSE(next.is_relocated);
}

TEST(Tracker, DoubtsFirstWhereTheOdometryCannotHaveTakenTheRobot) {
  const PostWorld world({1, 2, 3, 4, 5, 6, 7, 8});
  Robot robot(world);
  for (const std::int32_t place : {0, 1, 2}) (void)robot.DriveTo(place);
  const TrackedAnswer in_doubt = robot.DriftsTo(5);
  EXPECT_NE(in_doubt.answer.outcome, Outcome::kLocalized) << in_doubt.answer.reason;
  TrackedAnswer told = in_doubt;
  for (const std::int32_t place : {6, 7, 6, 7}) {
    told = robot.DriveTo(place);
    if (told.answer.outcome != Outcome::kLocalized) continue;
    EXPECT_EQ(told.answer.candidates.front().place, place);
  }
  EXPECT_EQ(told.answer.outcome, Outcome::kLocalized) << told.answer.reason;
}

TEST(Tracker, DoesWithoutOdometry) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  Robot robot(world, {.max_step_m = 60.0});
  EXPECT_EQ(robot.Look(1).answer.outcome, Outcome::kAmbiguous);
  const TrackedAnswer told = robot.Look(2);
  ASSERT_EQ(told.answer.outcome, Outcome::kLocalized) << told.answer.reason;
  EXPECT_EQ(told.answer.candidates.front().place, 2);
  EXPECT_EQ(told.num_scans, 2);
}

TEST(Tracker, IsNeverSureOutOfTheMap) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  const PostWorld elsewhere({71, 72, 73, 74, 75, 76, 77, 78, 79, 80});
  auto tracker = *Tracker::Create(world.localizer);
  for (std::int32_t place = 0; place < 10; ++place) {
    const auto told =
        tracker.Update(elsewhere.Seen(place, Pose::Identity()), Offset(40.0, 0.0, 0.0, 0.0));
    ASSERT_TRUE(told.ok()) << told.status();
    EXPECT_NE(told->answer.outcome, Outcome::kLocalized) << told->answer.reason;
    EXPECT_LE(tracker.num_tracks(), Tracker::kMaxTracks);
  }
}

TEST(Tracker, KeepsItsTrackOverAScanOfNothing) {
  const PostWorld world({1, 2, 3});
  Robot robot(world);
  (void)robot.DriveTo(0);
  const auto blind =
      robot.tracker().Update(Describer::Create(world.params)->Describe({}), Pose::Identity());
  ASSERT_TRUE(blind.ok()) << blind.status();
  EXPECT_EQ(blind->answer.outcome, Outcome::kInsufficientScan);
  const TrackedAnswer told = robot.DriveTo(1);
  EXPECT_EQ(told.num_scans, 2);
  EXPECT_EQ(told.answer.candidates.front().place, 1);
}

// A robot that hangs up, whatever it has just seen: enough to search for, or next to nothing.
TEST(Tracker, IsCancelledAndStaysAsItWas) {
  const PostWorld world({1, 2, 3});
  Robot robot(world);
  (void)robot.DriveTo(0);
  const ScanDescriptor flat = Describer::Create(world.params)->Describe(scenes::PostScan(5, 3));
  ASSERT_GE(flat.num_voxels, static_cast<std::uint32_t>(world.params.search.min_voxels));
  for (const ScanDescriptor& scan : {flat, world.Seen(1, Pose::Identity())}) {
    const auto told = robot.tracker().Update(scan, Offset(9.0, 0.0, 0.0, 0.0),
                                             {.is_unwanted = [] { return true; }});
    EXPECT_EQ(told.status().code(), absl::StatusCode::kCancelled);
  }
  EXPECT_EQ(robot.DriveTo(1).num_scans, 2);
}

TEST(Tracker, NeverTellsAPlaceThatIsExcluded) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  std::vector<bool> excluded(6);
  Robot robot(world);
  (void)robot.DriveTo(0);
  excluded[1] = true;
  // Its twin, place 4, is not where the robot can have got to.
  const TrackedAnswer elsewhere = robot.DriveTo(1, {.excluded = &excluded});
  for (const Candidate& told : elsewhere.answer.candidates) EXPECT_NE(told.place, 1);
  excluded.assign(6, true);
  const Answer nowhere = robot.DriveTo(2, {.excluded = &excluded}).answer;
  EXPECT_EQ(nowhere.outcome, Outcome::kNotRecognized);
  EXPECT_TRUE(nowhere.candidates.empty());
}

TEST(Tracker, LooksAtItsBestTrackHoweverLittleTimeThereIs) {
  static std::int64_t clock_ns;
  static std::int64_t tick_ns;
  clock_ns = 0;
  const PostWorld world({1, 2, 3});
  Robot robot(world);
  const auto control = [] { return TimedBy([] { return clock_ns += tick_ns; }, 100); };
  tick_ns = 0;
  EXPECT_EQ(robot.DriveTo(0, control()).num_scans, 1);
  tick_ns = 1000;  // over before the first look
  EXPECT_EQ(robot.DriveTo(1, control()).num_scans, 2);
  tick_ns = 0;
  EXPECT_EQ(robot.DriveTo(2, control()).num_scans, 3);
}

TEST(Tracker, ForgetsWhenReset) {
  const PostWorld world({1, 2, 3});
  Robot robot(world);
  (void)robot.DriveTo(0);
  robot.tracker().Reset();
  EXPECT_EQ(robot.tracker().num_tracks(), 0U);
  EXPECT_EQ(robot.DriveTo(1).num_scans, 1);
}

TEST(Tracker, GivesTheSameAnswersToTheSameScans) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  Robot one(world);
  Robot other(world);
  for (const std::int32_t place : {1, 2, 3, 0, 4, 5}) {
    test::ExpectSameAnswer(one.DriveTo(place).answer, other.DriveTo(place).answer);
  }
}

TEST(Tracker, RefusesBadOptionsAndPosesAndStaysAsItWas) {
  const PostWorld world({1, 2, 3});
  const auto code = [&](const TrackerOptions& options) {
    return Tracker::Create(world.localizer, options).status().code();
  };
  EXPECT_EQ(code({.query = {.method = *ParseMethod("a-pc")}}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code({.max_step_m = 0.0}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code({.max_step_m = std::numeric_limits<double>::quiet_NaN()}),
            absl::StatusCode::kInvalidArgument);
  Params plain;
  plain.structure.enabled = false;
  EXPECT_EQ(Tracker::Create(PostWorld({1}, plain).localizer).status().code(),
            absl::StatusCode::kFailedPrecondition);

  Robot robot(world);
  (void)robot.DriveTo(0);
  Pose stretched = Pose::Identity();
  stretched.linear() *= 2.0;
  Pose nan = Pose::Identity();
  nan.translation().x() = std::numeric_limits<double>::quiet_NaN();
  for (const Pose& bad : {stretched, nan}) {
    EXPECT_EQ(robot.tracker().Update(world.Seen(1, Pose::Identity()), bad).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(robot.DriveTo(1).num_scans, 2);
}

}  // namespace
}  // namespace scanloc
