#include "scanloc/eval/measures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace scanloc::eval {
namespace {

using Queries = std::vector<ScoredQuery>;

/// By looking at every threshold anew.
std::vector<OperatingPoint> PointsByHand(const Queries& queries) {
  std::set<double, std::greater<>> thresholds;
  double num_revisits = 0.0;
  for (const ScoredQuery& q : queries) {
    if (q.has_match) thresholds.insert(q.score);
    if (q.is_revisit) num_revisits += 1.0;
  }
  std::vector<OperatingPoint> points;
  for (const double threshold : thresholds) {
    double accepted = 0.0;
    double right = 0.0;
    for (const ScoredQuery& q : queries) {
      if (!q.has_match || q.score < threshold) continue;
      accepted += 1.0;
      if (q.is_right) right += 1.0;
    }
    OperatingPoint point{.threshold = threshold, .precision = right / accepted};
    point.recall = num_revisits > 0.0 ? right / num_revisits : 0.0;
    point.f1 = right > 0.0 ? 2.0 / (1.0 / point.precision + 1.0 / point.recall) : 0.0;
    points.push_back(point);
  }
  return points;
}

TEST(PrecisionRecall, OfAHandComputedCase) {
  // Surest first: right, wrong revisit, wrong non-revisit, right; one revisit without a match.
  const Queries queries = {{true, true, true, 0.9},
                           {true, true, false, 0.8},
                           {false, true, false, 0.7},
                           {true, true, true, 0.6},
                           {true, false, false, 0.0}};
  const PrecisionRecall measured = MeasurePrecisionRecall(queries);
  ASSERT_EQ(measured.points.size(), 4U);
  EXPECT_DOUBLE_EQ(measured.points[0].precision, 1.0);
  EXPECT_DOUBLE_EQ(measured.points[0].recall, 0.25);
  EXPECT_DOUBLE_EQ(measured.points[1].precision, 0.5);
  EXPECT_DOUBLE_EQ(measured.points[2].precision, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(measured.points[3].precision, 0.5);
  EXPECT_DOUBLE_EQ(measured.points[3].recall, 0.5);
  EXPECT_DOUBLE_EQ(measured.recall_at_full_precision, 0.25);
  EXPECT_DOUBLE_EQ(measured.f1_max, 0.5);
  EXPECT_DOUBLE_EQ(measured.extended_precision, 0.5 * (1.0 + 0.25));
  // 0.25 · 1, then from (0.25, 1/3) to (0.5, 1/2).
  EXPECT_DOUBLE_EQ(measured.area, 0.25 + 0.25 * 0.5 * (1.0 / 3.0 + 0.5));
}

TEST(PrecisionRecall, IsThatOfTheSlowWayOnRandomQueries) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 200; ++round) {
    Queries queries(random() % 40);
    for (ScoredQuery& q : queries) {
      q.is_revisit = random() % 3 > 0;
      q.has_match = random() % 5 > 0;
      q.is_right = q.is_revisit && q.has_match && random() % 2 == 0;
      q.score = static_cast<double>(random() % 12) / 11.0;  // with ties
    }
    const PrecisionRecall measured = MeasurePrecisionRecall(queries);
    const std::vector<OperatingPoint> expected = PointsByHand(queries);
    ASSERT_EQ(measured.points.size(), expected.size());
    double f1_max = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_DOUBLE_EQ(measured.points[i].threshold, expected[i].threshold);
      EXPECT_DOUBLE_EQ(measured.points[i].precision, expected[i].precision);
      EXPECT_DOUBLE_EQ(measured.points[i].recall, expected[i].recall);
      EXPECT_NEAR(measured.points[i].f1, expected[i].f1, 1e-12);
      f1_max = std::max(f1_max, expected[i].f1);
    }
    EXPECT_NEAR(measured.f1_max, f1_max, 1e-12);
    EXPECT_GE(measured.area, 0.0);
    EXPECT_LE(measured.area, 1.0 + 1e-12);
  }
}

TEST(PrecisionRecall, OfDegenerateCasesIsDefined) {
  const PrecisionRecall none = MeasurePrecisionRecall({});
  EXPECT_TRUE(none.points.empty());
  EXPECT_EQ(none.area, 0.0);
  EXPECT_EQ(none.recall_at_full_precision, 0.0);
  EXPECT_EQ(none.extended_precision, 0.0);
  EXPECT_FALSE(none.best.has_value());
  const Queries no_revisit = {{false, true, false, 0.5}};
  EXPECT_EQ(MeasurePrecisionRecall(no_revisit).points[0].precision, 0.0);
  EXPECT_EQ(MeasurePrecisionRecall(no_revisit).f1_max, 0.0);
  EXPECT_EQ(MeasurePrecisionRecall(no_revisit).area, 0.0);
  const Queries no_match = {{true, false, false, 0.5}};
  EXPECT_TRUE(MeasurePrecisionRecall(no_match).points.empty());
  const Queries ties = {{true, true, true, 0.5}, {true, true, false, 0.5}};
  ASSERT_EQ(MeasurePrecisionRecall(ties).points.size(), 1U);
  EXPECT_EQ(MeasurePrecisionRecall(ties).recall_at_full_precision, 0.0);
  EXPECT_DOUBLE_EQ(MeasurePrecisionRecall(ties).area, 0.25);
  EXPECT_DOUBLE_EQ(MeasurePrecisionRecall(ties).extended_precision, 0.25);
  const Queries perfect(7, {true, true, true, 1.0});
  EXPECT_DOUBLE_EQ(MeasurePrecisionRecall(perfect).area, 1.0);
  EXPECT_DOUBLE_EQ(MeasurePrecisionRecall(perfect).extended_precision, 1.0);
}

TEST(PrecisionRecall, AcceptsNothingWhereNoThresholdFindsARevisit) {
  const Queries hopeless = {{true, true, false, 0.9}, {true, true, false, 0.2}};
  const PrecisionRecall measured = MeasurePrecisionRecall(hopeless);
  EXPECT_EQ(measured.f1_max, 0.0);
  EXPECT_FALSE(measured.best.has_value());
  EXPECT_GT(measured.BestThreshold(), 1e300);
}

TEST(PrecisionRecall, IsBestAtTheHighestThresholdOfTheGreatestF1) {
  // F1 is 2/3 at 0.9 (precision 1, recall 1/2) and at 0.3 (1/2, 1).
  const Queries queries = {{true, true, true, 0.9},
                           {false, true, false, 0.8},
                           {false, true, false, 0.7},
                           {true, true, true, 0.3}};
  const PrecisionRecall measured = MeasurePrecisionRecall(queries);
  EXPECT_EQ(measured.points[0].f1, measured.points[3].f1);
  EXPECT_EQ(measured.best, 0U);
  EXPECT_EQ(measured.BestThreshold(), 0.9);
}

TEST(Reliability, OfAHandComputedCase) {
  const Queries queries = {{true, true, true, 0.95},
                           {true, true, true, 1.0},
                           {true, true, false, 0.9},
                           {false, true, false, 0.05},
                           {true, false, false, 0.5}};
  const Reliability measured = MeasureReliability(queries, 10);
  ASSERT_EQ(measured.bins.size(), 10U);
  EXPECT_EQ(measured.bins[9].num_queries, 3U);
  EXPECT_NEAR(measured.bins[9].mean_confidence, 0.95, 1e-12);
  EXPECT_NEAR(measured.bins[9].share_right, 2.0 / 3.0, 1e-12);
  EXPECT_EQ(measured.bins[0].num_queries, 1U);
  EXPECT_EQ(measured.bins[5].num_queries, 0U);
  EXPECT_NEAR(measured.expected_calibration_error, (3.0 * (0.95 - 2.0 / 3.0) + 1.0 * 0.05) / 4.0,
              1e-12);
  EXPECT_EQ(MeasureReliability({}, 10).expected_calibration_error, 0.0);
}

TEST(RecallAt, CountsRevisitsWithARightCandidateAmongTheFirst) {
  const std::vector<int> first_right = {1, 3, 0, 10};
  EXPECT_EQ(RecallAt(1, first_right, 10), 0.25);
  EXPECT_EQ(RecallAt(5, first_right, 10), 0.5);
  EXPECT_EQ(RecallAt(10, first_right, 10), 0.75);
}

TEST(RecallAt, IsNoneWithoutRevisitsAndWhereFewerCandidatesAreLookedAt) {
  EXPECT_EQ(RecallAt(1, {}, 10), std::nullopt);
  const std::vector<int> first_right = {1, 0};
  EXPECT_EQ(RecallAt(1, first_right, 1), 0.5);
  EXPECT_EQ(RecallAt(5, first_right, 1), std::nullopt);
  EXPECT_EQ(RecallAt(10, first_right, 5), std::nullopt);
}

}  // namespace
}  // namespace scanloc::eval
