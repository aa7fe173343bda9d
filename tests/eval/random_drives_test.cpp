#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "scanloc/eval/ground_truth.hpp"
#include "scanloc/eval/judging.hpp"
#include "scanloc/eval/measures.hpp"
#include "scanloc/eval/quantile.hpp"
#include "scanloc/eval/recall_distribution.hpp"
#include "support/brute_force_eval.hpp"

// Every measure, from poses and answers on, against the slow way, on many small drives.

namespace scanloc::eval {
namespace {

using brute_force::Figures;
using brute_force::PlanePose;
using brute_force::SmallDrive;

constexpr std::uint64_t kNumDrives = 1000;

Pose ToPose(const PlanePose& pose) {
  Pose T = PlanarOffset(0.0, pose.yaw_rad);
  T.translation() = Eigen::Vector3d(pose.x_m, pose.y_m, 0.1 * pose.x_m);
  return T;
}

/// What eval makes of a drive.
struct Measured {
  explicit Measured(const SmallDrive& drive) {
    std::vector<Place> places;
    for (const SmallDrive::MapPlace& place : drive.places) {
      places.push_back({.T_map_place = ToPose(place.pose), .stamp_ns = place.stamp_ns});
    }
    for (const SmallDrive::Query& query : drive.queries) {
      QueryTruth truth;
      if (query.truth) {
        truth.T_map_query = ToPose(*query.truth);
        truth.nearest =
            NearestPlace(places, HiddenPlaces(places, query.sees_until_ns), *truth.T_map_query);
      }
      std::vector<Candidate> candidates;
      for (const SmallDrive::Told& told : query.told) {
        Candidate candidate;
        candidate.T_map_place = places[static_cast<std::size_t>(told.place)].T_map_place;
        candidate.T_map_query = ToPose(told.pose);
        candidate.confidence = told.confidence;
        candidates.push_back(candidate);
      }
      Add(truth, Judge(truth, candidates, drive.within_m));
    }
    curve = MeasurePrecisionRecall(scored);
  }

  void Add(const QueryTruth& truth, const Judgement& judgement) {
    nearest.push_back(truth.nearest);
    variances.push_back(truth.nearest.value_or(RevisitVariance{}));
    scored.push_back(judgement.scored);
    if (judgement.scored.is_revisit) first_right.push_back(judgement.first_right);
    num_right_beyond += judgement.is_right_beyond ? 1 : 0;
    if (judgement.scored.has_match) {
      confident.push_back(judgement.scored);
      confident.back().is_right = judgement.is_pose_right;
    }
    if (!judgement.scored.is_right) return;
    position_m.push_back(judgement.error->off.plane_m);
    lateral_m.push_back(judgement.error->lateral_m);
    yaw_deg.push_back(judgement.error->off.heading_deg);
  }

  std::vector<std::optional<RevisitVariance>> nearest;
  std::vector<RevisitVariance> variances;
  std::vector<ScoredQuery> scored, confident;
  std::vector<int> first_right;
  int num_right_beyond = 0;
  std::vector<double> position_m, lateral_m, yaw_deg;
  PrecisionRecall curve;
};

template <typename Check>
void ForEachDrive(Check&& check) {
  for (std::uint64_t seed = 1; seed <= kNumDrives; ++seed) {
    const SmallDrive drive = brute_force::RandomDrive(seed);
    SCOPED_TRACE(seed);
    check(drive, Measured(drive), brute_force::Evaluate(drive));
    if (testing::Test::HasFailure()) return;
  }
}

TEST(RandomDrives, HaveAllThatCanBeAmiss) {
  int num_without_revisit = 0, num_without_match = 0, num_of_ties = 0, num_hopeless = 0;
  int num_beyond = 0, num_full = 0;
  ForEachDrive([&](const SmallDrive&, const Measured&, const Figures& expected) {
    if (expected.num_revisits == 0) ++num_without_revisit;
    if (expected.points.empty()) ++num_without_match;
    if (expected.points.size() == 1) ++num_of_ties;
    if (!expected.points.empty() && expected.f1_max == 0.0) ++num_hopeless;
    if (expected.num_right_beyond > 0) ++num_beyond;
    if (expected.recall_at_full_precision > 0.0) ++num_full;
  });
  for (const int num :
       {num_without_revisit, num_without_match, num_of_ties, num_hopeless, num_beyond, num_full}) {
    EXPECT_GE(num, 20);
  }
}

TEST(RandomDrives, TruthIsThatOfTheSlowWay) {
  ForEachDrive([](const SmallDrive& drive, const Measured& measured, const Figures& expected) {
    EXPECT_EQ(measured.num_right_beyond, expected.num_right_beyond);
    for (std::size_t i = 0; i < drive.queries.size(); ++i) {
      ASSERT_EQ(measured.nearest[i].has_value(), expected.nearest[i].has_value()) << i;
      EXPECT_EQ(measured.scored[i].is_revisit, expected.is_revisit[i]) << i;
      EXPECT_EQ(measured.scored[i].is_right, expected.is_right[i]) << i;
      if (!measured.nearest[i]) continue;
      EXPECT_NEAR(measured.nearest[i]->translation_m, expected.nearest[i]->distance_m, 1e-9);
      EXPECT_NEAR(measured.nearest[i]->rotation_deg, expected.nearest[i]->turn_deg, 1e-9);
    }
  });
}

TEST(RandomDrives, CurvesAreThoseOfTheSlowWay) {
  ForEachDrive([](const SmallDrive&, const Measured& measured, const Figures& expected) {
    const PrecisionRecall& curve = measured.curve;
    ASSERT_EQ(curve.points.size(), expected.points.size());
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      EXPECT_EQ(curve.points[i].threshold, expected.points[i].threshold);
      EXPECT_NEAR(curve.points[i].precision, expected.points[i].precision, 1e-12);
      EXPECT_NEAR(curve.points[i].recall, expected.points[i].recall, 1e-12);
      EXPECT_NEAR(curve.points[i].f1, expected.points[i].f1, 1e-12);
    }
    EXPECT_NEAR(curve.area, expected.area, 1e-12);
    EXPECT_NEAR(curve.f1_max, expected.f1_max, 1e-12);
    EXPECT_NEAR(curve.recall_at_full_precision, expected.recall_at_full_precision, 1e-12);
    EXPECT_NEAR(curve.extended_precision, expected.extended_precision, 1e-12);
    EXPECT_EQ(curve.best.has_value(), expected.best_threshold.has_value());
    EXPECT_EQ(curve.BestThreshold(), expected.best_threshold.value_or(INFINITY));
  });
}

TEST(RandomDrives, RecallAndCalibrationAreThoseOfTheSlowWay) {
  ForEachDrive([](const SmallDrive&, const Measured& measured, const Figures& expected) {
    for (const int n : {1, 5, 10}) {
      const std::optional<double> recall = RecallAt(n, measured.first_right, 10);
      ASSERT_EQ(recall.has_value(), expected.recall_at.at(n).has_value());
      EXPECT_NEAR(recall.value_or(0.0), expected.recall_at.at(n).value_or(0.0), 1e-12);
    }
    EXPECT_NEAR(MeasureReliability(measured.confident, 10).expected_calibration_error,
                expected.calibration_error, 1e-12);
  });
}

TEST(RandomDrives, DistributionsAreThoseOfTheSlowWay) {
  ForEachDrive([](const SmallDrive& drive, const Measured& measured, const Figures& expected) {
    RevisitHistogram histogram(drive.within_m);
    for (std::size_t i = 0; i < measured.scored.size(); ++i) {
      if (measured.scored[i].is_revisit) histogram.Add(measured.variances[i]);
    }
    EXPECT_EQ(histogram.total(), static_cast<std::size_t>(expected.num_revisits));
    for (const auto& [bin, count] : expected.histogram) {
      EXPECT_EQ(histogram.count(bin.first, bin.second), static_cast<std::size_t>(count));
    }
    const auto check = [&](std::optional<RevisitKind> kind, const Figures::DrCurve& dr) {
      const std::vector<double> divergences = MeasureDivergences(
          measured.variances, measured.scored, measured.curve.points, drive.within_m, kind);
      ASSERT_EQ(divergences.size(), dr.size());
      for (std::size_t i = 0; i < dr.size(); ++i) {
        ASSERT_EQ(std::isnan(divergences[i]), !dr[i].has_value()) << i;
        if (!dr[i]) continue;
        EXPECT_NEAR(divergences[i], *dr[i], 1e-9) << i;
      }
    };
    check(std::nullopt, expected.dr);
    for (std::size_t kind = 0; kind < 4; ++kind) {
      const bool is_any = expected.num_of_kind[kind] > 0;
      check(static_cast<RevisitKind>(kind),
            is_any ? expected.dr_of_kind[kind] : Figures::DrCurve{});
    }
  });
}

TEST(RandomDrives, ErrorsAreThoseOfTheSlowWay) {
  ForEachDrive([](const SmallDrive&, const Measured& measured, const Figures& expected) {
    const auto check = [](const std::vector<double>& errors, const std::vector<double>& slow) {
      const std::optional<ErrorSummary> summary = Summarize(errors);
      ASSERT_EQ(summary.has_value(), !slow.empty());
      if (!summary) return;
      double sum = 0.0;
      for (const double error : slow) sum += error;
      EXPECT_NEAR(summary->mean, sum / static_cast<double>(slow.size()), 1e-9);
      EXPECT_NEAR(summary->median, brute_force::QuantileOf(slow, 0.5), 1e-9);
      EXPECT_NEAR(summary->p90, brute_force::QuantileOf(slow, 0.9), 1e-9);
    };
    check(measured.position_m, expected.position_errors_m);
    check(measured.lateral_m, expected.lateral_errors_m);
    check(measured.yaw_deg, expected.yaw_errors_deg);
  });
}

}  // namespace
}  // namespace scanloc::eval
