#include "scanloc/report/query_result.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace scanloc::report {
namespace {

Candidate CandidateAt(double x_m, double y_m, double yaw_rad = 0.0) {
  Candidate candidate;
  candidate.T_map_place.translation() = Eigen::Vector3d(x_m, y_m, 0.0);
  candidate.T_map_query = candidate.T_map_place * PlanarOffset(0.0, yaw_rad);
  return candidate;
}

QueryResult Result(Outcome outcome, std::vector<Candidate> candidates, std::optional<Pose> truth) {
  QueryResult result;
  result.answer.outcome = outcome;
  result.answer.candidates = std::move(candidates);
  result.T_map_true = truth;
  return result;
}

TEST(ErrorOf, TellsPlaneAndHeightApart) {
  Candidate candidate = CandidateAt(3.0, 4.0);
  candidate.T_map_query.translation() += Eigen::Vector3d(-3.0, 0.0, 50.0);
  Pose truth = Pose::Identity();
  truth.translation().z() = 100.0;
  const TruthError error = ErrorOf(candidate, truth);
  EXPECT_DOUBLE_EQ(error.place_m, 5.0);
  EXPECT_DOUBLE_EQ(error.pose.plane_m, 4.0);
  EXPECT_DOUBLE_EQ(error.pose.height_m, 50.0);
}

TEST(ErrorOf, TakesTheShortWayRound) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  const TruthError error =
      ErrorOf(CandidateAt(0.0, 0.0, 179.0 * kDeg), PlanarOffset(0.0, -179.0 * kDeg));
  EXPECT_NEAR(error.pose.heading_deg, 2.0, 1e-9);
}

TEST(Summarize, CountsRecallWhateverTheOutcome) {
  const Pose origin = Pose::Identity();
  const Summary summary = Summarize(
      {
          Result(Outcome::kLocalized, {CandidateAt(1.0, 0.0)}, origin),
          Result(Outcome::kLocalized, {CandidateAt(100.0, 0.0), CandidateAt(0.0, 8.0)}, origin),
          Result(Outcome::kNotRecognized, {CandidateAt(3.0, 0.0)}, origin),
          Result(Outcome::kInsufficientScan, {}, origin),
          Result(Outcome::kAmbiguous, {CandidateAt(0.0, 8.1)}, origin),
          Result(Outcome::kLocalized, {CandidateAt(0.0, 0.0)}, std::nullopt),
      },
      8.0);
  EXPECT_EQ(summary.all.num_queries, 6U);
  EXPECT_EQ(summary.all.num_localized, 3U);
  EXPECT_EQ(summary.all.num_ambiguous, 1U);
  EXPECT_EQ(summary.all.num_not_recognized, 1U);
  EXPECT_EQ(summary.all.num_insufficient, 1U);
  EXPECT_EQ(summary.with_truth.num_queries, 5U);
  EXPECT_EQ(summary.num_top1_right, 2U);
  EXPECT_EQ(summary.num_topk_right, 3U);
  EXPECT_EQ(summary.with_truth.num_localized, 2U);
  EXPECT_EQ(summary.with_truth.num_localized_right, 1U);
  EXPECT_EQ(summary.with_truth.num_false, 1U);
  EXPECT_DOUBLE_EQ(*summary.median_place_m, 2.0);
}

TEST(Summarize, CallsAnotherFloorFalseThoughItsPlaceIsRecalled) {
  Candidate other_floor = CandidateAt(0.0, 0.0);
  other_floor.T_map_query.translation().z() = 3.5;
  const Summary summary =
      Summarize({Result(Outcome::kLocalized, {other_floor}, Pose::Identity())}, 8.0);
  EXPECT_EQ(summary.num_top1_right, 1U);
  EXPECT_EQ(summary.with_truth.num_false, 1U);
  EXPECT_EQ(summary.with_truth.num_false_height, 1U);
  EXPECT_EQ(summary.with_truth.num_false_plane, 0U);
}

TEST(Summarize, HasNoMediansWithoutTruth) {
  const Summary summary =
      Summarize({Result(Outcome::kLocalized, {CandidateAt(1.0, 0.0)}, std::nullopt)}, 8.0);
  EXPECT_EQ(summary.with_truth.num_queries, 0U);
  EXPECT_FALSE(summary.median_pose_m.has_value());
}

}  // namespace
}  // namespace scanloc::report
