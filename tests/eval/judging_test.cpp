#include "scanloc/eval/judging.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "scanloc/eval/ground_truth.hpp"

namespace scanloc::eval {
namespace {

constexpr double kPi = std::numbers::pi;

Pose At(double x_m, double y_m, double yaw_rad = 0.0, double z_m = 0.0) {
  Pose T = PlanarOffset(0.0, yaw_rad);
  T.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  return T;
}

Candidate Found(const Pose& T_map_place, const Pose& T_map_query, double distance = 0.25) {
  Candidate candidate;
  candidate.T_map_place = T_map_place;
  candidate.T_map_query = T_map_query;
  candidate.distance = distance;
  return candidate;
}

/// Places every 5 m along x, mapped a second apart.
std::vector<Place> Street(int num_places) {
  std::vector<Place> places;
  for (int i = 0; i < num_places; ++i) {
    places.push_back({.T_map_place = At(5.0 * i, 0.0), .stamp_ns = 1'000'000'000LL * i});
  }
  return places;
}

QueryTruth TruthAt(const std::vector<Place>& places, const Pose& T_map_true) {
  return {T_map_true, NearestPlace(places, {}, T_map_true)};
}

TEST(NearestPlace, IsTakenInThePlaneAndTellsHowTheQueryDiffers) {
  const std::vector<Place> places = Street(4);
  const std::optional<RevisitVariance> nearest = NearestPlace(places, {}, At(9.0, 3.0, kPi, 100.0));
  ASSERT_TRUE(nearest.has_value());
  EXPECT_DOUBLE_EQ(nearest->translation_m, std::hypot(1.0, 3.0));
  EXPECT_DOUBLE_EQ(nearest->rotation_deg, 180.0);
  EXPECT_DOUBLE_EQ(NearestPlace(places, {}, At(0.0, 0.0, -0.75 * kPi))->rotation_deg, 135.0);
  EXPECT_FALSE(NearestPlace({}, {}, At(0.0, 0.0)).has_value());
}

TEST(NearestPlace, IsOneThatTheQuerySees) {
  const std::vector<Place> places = Street(4);
  // Mapped at 0, 1, 2 and 3 s: what was mapped at 2 s is not before 2 s.
  const std::vector<bool> hidden = HiddenPlaces(places, 2'000'000'000);
  EXPECT_EQ(hidden, (std::vector<bool>{false, false, true, true}));
  EXPECT_DOUBLE_EQ(NearestPlace(places, hidden, At(15.0, 0.0))->translation_m, 10.0);
  EXPECT_FALSE(NearestPlace(places, HiddenPlaces(places, 0), At(15.0, 0.0)).has_value());
  EXPECT_TRUE(HiddenPlaces(places, std::nullopt).empty());
}

TEST(IsRevisit, ReachesToTheLimit) {
  EXPECT_TRUE(IsRevisit(RevisitVariance{.translation_m = 8.0}, 8.0));
  EXPECT_FALSE(IsRevisit(RevisitVariance{.translation_m = 8.01}, 8.0));
  EXPECT_FALSE(IsRevisit(std::nullopt, 8.0));
}

TEST(ErrorOf, IsAcrossTheTrueHeadingToo) {
  // The vehicle heads along +y: its left is -x.
  const PoseError error = ErrorOf(At(3.0, 4.0, -0.5 * kPi, 7.0), At(0.0, 0.0, 0.5 * kPi));
  EXPECT_DOUBLE_EQ(error.off.plane_m, 5.0);
  EXPECT_DOUBLE_EQ(error.lateral_m, 3.0);
  EXPECT_DOUBLE_EQ(error.off.height_m, 7.0);
  EXPECT_NEAR(error.off.heading_deg, 180.0, 1e-9);
}

TEST(Judge, CallsAMatchRightWhosePlaceIsNear) {
  const std::vector<Place> places = Street(4);
  const QueryTruth truth = TruthAt(places, At(5.0, 2.0));
  const std::vector<Candidate> candidates = {Found(places[2].T_map_place, At(5.0, 1.0))};
  const Judgement judgement = Judge(truth, candidates, 8.0);
  EXPECT_TRUE(judgement.scored.is_revisit);
  EXPECT_TRUE(judgement.scored.is_right);
  EXPECT_EQ(judgement.first_right, 1);
  EXPECT_DOUBLE_EQ(judgement.scored.score, 0.75);
  ASSERT_TRUE(judgement.error.has_value());
  EXPECT_DOUBLE_EQ(judgement.error->off.plane_m, 1.0);
}

TEST(Judge, CallsAPoseRightInPlaneHeightAndHeadingOnly) {
  constexpr double kDegree = kPi / 180.0;
  const std::vector<Place> places = Street(1);
  const QueryTruth truth = TruthAt(places, At(0.0, 0.0));
  const auto is_right = [&](const Pose& told) {
    const std::vector<Candidate> candidates = {Found(places[0].T_map_place, told)};
    const Judgement judgement = Judge(truth, candidates, 8.0);
    EXPECT_TRUE(judgement.scored.is_right) << "by the paper's measure all of them are";
    return judgement.is_pose_right;
  };
  EXPECT_TRUE(is_right(At(0.6, -0.7, 9.0 * kDegree, -0.9)));
  EXPECT_FALSE(is_right(At(0.9, -0.7)));
  EXPECT_FALSE(is_right(At(0.0, 0.0, 0.0, 1.1)));
  EXPECT_FALSE(is_right(At(0.0, 0.0, 11.0 * kDegree)));
  EXPECT_FALSE(is_right(At(0.0, 0.0, kPi)));
}

TEST(OutcomeCounts, CountsFalseAnswersByWhatTheyMiss) {
  const std::vector<Place> places = Street(1);
  const QueryTruth truth = TruthAt(places, At(0.0, 0.0));
  OutcomeCounts counts;
  const auto add = [&](Outcome outcome, const QueryTruth& of, const Pose& told) {
    Answer answer;
    answer.outcome = outcome;
    answer.candidates = {Found(places[0].T_map_place, told)};
    counts.Add(answer, Judge(of, answer.candidates, 8.0));
  };
  add(Outcome::kLocalized, truth, At(0.0, 0.5));
  add(Outcome::kLocalized, truth, At(0.0, 0.5, kPi, 3.5));
  add(Outcome::kLocalized, truth, At(5.0, 0.0));
  add(Outcome::kLocalized, {}, At(0.0, 0.0));
  add(Outcome::kAmbiguous, truth, At(0.0, 0.0));
  add(Outcome::kNotRecognized, truth, At(5.0, 0.0));
  counts.Add(Answer{.outcome = Outcome::kInsufficientScan}, Judgement{});
  EXPECT_EQ(counts.num_queries, 7U);
  EXPECT_EQ(counts.num_localized, 4U);
  EXPECT_EQ(counts.num_localized_right, 1U);
  EXPECT_EQ(counts.num_pose_right, 2U);
  EXPECT_EQ(counts.num_false, 3U);
  EXPECT_EQ(counts.num_false_plane, 1U);
  EXPECT_EQ(counts.num_false_height, 1U);
  EXPECT_EQ(counts.num_false_heading, 1U);
  EXPECT_EQ(counts.num_ambiguous, 1U);
  EXPECT_EQ(counts.num_not_recognized, 1U);
  EXPECT_EQ(counts.num_insufficient, 1U);
}

TEST(MissText, NamesAllThatAreMissed) {
  EXPECT_EQ(MissText({}), "");
  EXPECT_EQ(MissText({.plane = true}), "plane");
  EXPECT_EQ(MissText({.height = true, .heading = true}), "height+heading");
}

TEST(Judge, ScoresByTheConfidenceWhereThereIsOne) {
  const std::vector<Place> places = Street(1);
  Candidate sure = Found(places[0].T_map_place, At(0.0, 0.0));
  sure.confidence = 0.99;
  EXPECT_EQ(Judge(TruthAt(places, At(0.0, 0.0)), std::vector<Candidate>{sure}, 8.0).scored.score,
            0.99);
}

TEST(Judge, CountsARightPoseOfAWrongPlaceAsWrong) {
  const std::vector<Place> places = Street(4);
  // The place told lies 10 m off, the pose told is the true one.
  const QueryTruth truth = TruthAt(places, At(0.0, 0.0));
  const Judgement judgement =
      Judge(truth, std::vector<Candidate>{Found(places[2].T_map_place, At(0.0, 0.0))}, 8.0);
  EXPECT_TRUE(judgement.scored.is_revisit);
  EXPECT_TRUE(judgement.scored.has_match);
  EXPECT_FALSE(judgement.scored.is_right);
  EXPECT_TRUE(judgement.is_pose_right);
  EXPECT_FALSE(judgement.is_right_beyond) << "a place lies within the limit";
}

TEST(Judge, CountsARightPoseWithoutAPlaceNearAsWrongAndNamesIt) {
  const std::vector<Place> places = Street(4);
  const QueryTruth truth = TruthAt(places, At(5.0, 9.0));  // 9 m beside the nearest place
  const std::vector<Candidate> candidates = {Found(places[1].T_map_place, At(5.0, 9.0))};
  const Judgement judgement = Judge(truth, candidates, 8.0);
  EXPECT_FALSE(judgement.scored.is_revisit);
  EXPECT_TRUE(judgement.scored.has_match) << "it counts against precision";
  EXPECT_FALSE(judgement.scored.is_right);
  EXPECT_TRUE(judgement.is_right_beyond);
  const std::vector<ScoredQuery> queries = {judgement.scored};
  EXPECT_EQ(MeasurePrecisionRecall(queries).points[0].precision, 0.0);
  EXPECT_TRUE(Judge(truth, candidates, 10.0).scored.is_right);
}

TEST(Judge, FindsTheRankOfTheFirstRightCandidate) {
  const std::vector<Place> places = Street(10);
  const QueryTruth truth = TruthAt(places, At(0.0, 0.0));
  std::vector<Candidate> candidates;
  for (const std::size_t place : {9, 8, 1, 0}) {
    candidates.push_back(Found(places[place].T_map_place, places[place].T_map_place));
  }
  EXPECT_EQ(Judge(truth, candidates, 8.0).first_right, 3);
  EXPECT_FALSE(Judge(truth, candidates, 8.0).scored.is_right);
  candidates.resize(2);
  EXPECT_EQ(Judge(truth, candidates, 8.0).first_right, 0);
}

TEST(Judge, HasAnAnswerForEveryQuery) {
  const std::vector<Place> places = Street(2);
  const Judgement missed = Judge(TruthAt(places, At(0.0, 0.0)), {}, 8.0);
  EXPECT_TRUE(missed.scored.is_revisit);
  EXPECT_FALSE(missed.scored.has_match);
  EXPECT_EQ(missed.first_right, 0);
  const std::vector<Candidate> candidates = {Found(places[0].T_map_place, At(0.0, 0.0))};
  const Judgement elsewhere = Judge({}, candidates, 8.0);
  EXPECT_FALSE(elsewhere.scored.is_revisit);
  EXPECT_TRUE(elsewhere.scored.has_match);
  EXPECT_FALSE(elsewhere.scored.is_right);
  EXPECT_FALSE(elsewhere.is_pose_right);
}

}  // namespace
}  // namespace scanloc::eval
