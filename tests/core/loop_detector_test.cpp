#include "scanloc/core/loop_detector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/post_world.hpp"
#include "support/same_answer.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

using test::Offset;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

PointCloud Scene(int number) { return scenes::PostScan(static_cast<std::uint64_t>(number), 70); }

/// Where the robot is: at a new scene every 40 m, uphill, once a second.
Pose At(int number) {
  return Offset(40.0 * number, 3.0 * (number % 50), 0.05 * number, 0.4 * number);
}

LoopDetector MakeDetector(const LoopDetectorOptions& options = {}) {
  return LoopDetector::Create(options).value();
}

void Drive(LoopDetector& detector, int begin, int end) {
  for (int i = begin; i < end; ++i) {
    const auto place = detector.Add(Scene(i), i * kSecond_ns, At(i));
    ASSERT_TRUE(place.ok()) << place.status();
    ASSERT_EQ(*place, i);
  }
}

TEST(LoopDetector, AnswersAsALocalizerOverThePlacesOutsideTheWindow) {
  constexpr int kNumPlaces = 420;  // several trees of each kind
  constexpr int kWindow = 10;
  auto describer = *Describer::Create({});
  std::vector<PlaceDescriptor> described;
  for (int i = 0; i < kNumPlaces; ++i) described.push_back(describer.DescribePlace(Scene(i)));
  for (const auto& [method, num_candidates] :
       {std::pair{"auto", 100}, {"a-pc", 10}, {"a-cc-naive", 10}, {"pc-brute", 1}}) {
    SCOPED_TRACE(method);
    LoopDetectorOptions options;
    options.query = {
        .method = *ParseMethod(method), .num_candidates = num_candidates, .max_answers = 3};
    options.window_s = kWindow;
    LoopDetector detector = MakeDetector(options);
    auto seen = std::make_shared<Map>(MakeEmptyMap(options.params));
    seen->sessions = {"drive"};
    for (int i = 0; i < kNumPlaces; ++i) {
      ASSERT_TRUE(detector.Add(described[i], i * kSecond_ns, At(i)).ok());
      if (i >= kWindow) {
        seen->AppendDescriptor(i - kWindow, described[i - kWindow]);
        seen->places.push_back({detector.T_map_place(i - kWindow), 0, 0});
      }
      if (i % 60 != 45 && i != kNumPlaces - 1) continue;
      const auto localizer = *Localizer::Create(std::make_shared<Map>(*seen));
      for (const int revisited : {0, i / 2, i - kWindow, i - kWindow + 1}) {
        const ScanDescriptor scan =
            describer.Describe(scenes::SeenFrom(Scene(revisited), Offset(0.5, 1.0, 0.0, 0.7)));
        const auto said = detector.Query(scan, i * kSecond_ns);
        ASSERT_TRUE(said.ok()) << said.status();
        test::ExpectSameAnswer(said->answer, *localizer->Localize(scan, options.query));
      }
    }
  }
}

TEST(LoopDetector, TellsThePoseOfTheScanInTheFrameOfThePlace) {
  LoopDetector detector = MakeDetector({.window_s = 0.0});
  Drive(detector, 0, 30);
  const Pose T_place_scan = Offset(0.8, 1.5, 0.0, 3.0);
  const auto said = detector.Query(scenes::SeenFrom(Scene(7), T_place_scan), 100 * kSecond_ns);
  ASSERT_TRUE(said.ok()) << said.status();
  ASSERT_TRUE(said->loop.has_value()) << said->answer.reason;
  EXPECT_EQ(said->loop->place, 7);
  const Pose error = T_place_scan.inverse() * said->loop->T_place_scan;
  EXPECT_LT(error.translation().norm(), 0.3);
  EXPECT_LT(Eigen::AngleAxisd(error.linear()).angle(), 0.02);
}

TEST(LoopDetector, TellsTheInformationAboutTheAxesOfThePlace) {
  LoopDetector detector = MakeDetector({.window_s = 0.0});
  Drive(detector, 0, 30);
  const auto said = detector.Query(Scene(7), 100 * kSecond_ns);
  ASSERT_TRUE(said.ok() && said->loop && said->loop->information) << said.status();
  const Candidate& best = said->answer.candidates.front();
  const Eigen::Matrix3d R_place_map = detector.T_map_place(7).linear().transpose();
  const PoseCovariance covariance = Rotated(R_place_map, *best.covariance);
  EXPECT_TRUE((*said->loop->information * covariance).isIdentity(1e-6));
  EXPECT_TRUE(said->loop->information->ldlt().isPositive());

  LoopDetector by_contexts =
      MakeDetector({.query = {.method = *ParseMethod("a-pc")}, .window_s = 0.0});
  Drive(by_contexts, 0, 30);
  const auto told = by_contexts.Query(Scene(7), 100 * kSecond_ns);
  ASSERT_TRUE(told.ok() && told->loop) << told.status();
  EXPECT_FALSE(told->loop->information.has_value());
}

TEST(LoopDetector, LeavesOutTheWindow) {
  for (const LoopDetectorOptions& options :
       {LoopDetectorOptions{.window_s = 5.0},
        LoopDetectorOptions{.window_s = 0.0, .window_places = 5}}) {
    LoopDetector detector = MakeDetector(options);
    Drive(detector, 0, 30);
    // Taken when the last place was: five places and five seconds after place 24.
    EXPECT_TRUE(detector.Query(Scene(24), 29 * kSecond_ns)->loop.has_value());
    EXPECT_FALSE(detector.Query(Scene(25), 29 * kSecond_ns)->loop.has_value());
    EXPECT_FALSE(detector.Query(Scene(29), 29 * kSecond_ns)->loop.has_value());
    EXPECT_EQ(detector.num_places(), 30U);
  }
}

TEST(LoopDetector, SaysNothingBeforeThereIsAPlace) {
  LoopDetector detector = MakeDetector();
  const auto said = detector.Query(Scene(1), 0);
  ASSERT_TRUE(said.ok()) << said.status();
  EXPECT_EQ(said->answer.outcome, Outcome::kNotRecognized);
  EXPECT_FALSE(said->loop.has_value());
  EXPECT_EQ(detector.Query(PointCloud{}, 0)->answer.outcome, Outcome::kInsufficientScan);
}

TEST(LoopDetector, KeepsARelativePoseWhenPlacesAreMoved) {
  LoopDetector detector = MakeDetector({.window_s = 3.0});
  Drive(detector, 0, 30);
  std::vector<Pose> moved;
  for (int i = 0; i < 30; ++i) moved.push_back(Offset(5.0, -9.0, 1.0, 0.5) * At(i));
  ASSERT_TRUE(detector.MovePlaces(moved).ok());
  Drive(detector, 30, 40);
  const auto said = detector.Query(Scene(28), 40 * kSecond_ns);
  ASSERT_TRUE(said.ok() && said->loop) << said.status();
  EXPECT_EQ(said->loop->place, 28);
  EXPECT_LT(said->loop->T_place_scan.translation().norm(), 0.1);
  const Pose& T_map_query = said->answer.candidates.front().T_map_query;
  EXPECT_LT((T_map_query.translation() - moved[28].translation()).norm(), 0.1);
}

TEST(LoopDetector, RefusesBadInputAndStaysAsItWas) {
  LoopDetector detector = MakeDetector({.window_s = 0.0});
  Drive(detector, 0, 20);
  Pose not_finite = At(20);
  not_finite.translation().x() = std::numeric_limits<double>::quiet_NaN();
  Pose stretched = At(20);
  stretched.linear() *= 2.0;
  Params other;
  other.polar.num_rings = 10;
  auto others_describer = *Describer::Create(other);
  const std::vector<Pose> too_few(19, Pose::Identity());
  std::vector<Pose> one_bad(20, Pose::Identity());
  one_bad[11] = not_finite;
  for (const absl::Status& status :
       {detector.Add(Scene(20), 18 * kSecond_ns, At(20)).status(),
        detector.Add(Scene(20), 20 * kSecond_ns, not_finite).status(),
        detector.Add(Scene(20), 20 * kSecond_ns, stretched).status(),
        detector.Add(others_describer.DescribePlace(Scene(20)), 20 * kSecond_ns, At(20)).status(),
        detector.Query(others_describer.Describe(Scene(20)), 20 * kSecond_ns).status(),
        detector.Query(Scene(20), 18 * kSecond_ns).status(), detector.MovePlaces(too_few),
        detector.MovePlaces(one_bad)}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  }
  EXPECT_THAT(std::string(detector.MovePlaces(one_bad).message()), HasSubstr("place 11"));
  Drive(detector, 20, 21);
  EXPECT_EQ(detector.Query(Scene(20), 20 * kSecond_ns)->loop->place, 20);
}

TEST(LoopDetector, RefusesBadOptions) {
  LoopDetectorOptions no_polar;
  no_polar.params.polar.enabled = false;
  no_polar.query.method = *ParseMethod("a-pc");
  EXPECT_EQ(LoopDetector::Create(no_polar).status().code(), absl::StatusCode::kFailedPrecondition);
  LoopDetectorOptions bad_params;
  bad_params.params.voxel_size_m = -1.0;
  for (const LoopDetectorOptions& options :
       {bad_params, LoopDetectorOptions{.query = {.num_candidates = 0}},
        LoopDetectorOptions{.window_s = -1.0},
        LoopDetectorOptions{.window_s = std::numeric_limits<double>::quiet_NaN()},
        LoopDetectorOptions{.window_places = -1}}) {
    EXPECT_EQ(LoopDetector::Create(options).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace scanloc
