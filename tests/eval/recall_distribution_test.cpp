#include "scanloc/eval/recall_distribution.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace scanloc::eval {
namespace {

TEST(RevisitHistogram, CountsInBinsOfHalfAMetreAndTenDegrees) {
  RevisitHistogram histogram(8.0);
  EXPECT_EQ(histogram.num_translation_bins(), 16);
  histogram.Add({0.0, 0.0});
  histogram.Add({0.49, 9.9});
  histogram.Add({0.5, 10.0});
  histogram.Add({7.99, 180.0});
  histogram.Add({100.0, 175.0});
  EXPECT_EQ(histogram.count(0, 0), 2U);
  EXPECT_EQ(histogram.count(1, 1), 1U);
  EXPECT_EQ(histogram.count(15, 17), 2U);
  EXPECT_EQ(histogram.total(), 5U);
}

TEST(KindOf, IsThePapersQuadrant) {
  EXPECT_STREQ(KindName(KindOf({0.5, 10.0})), "easy");
  EXPECT_STREQ(KindName(KindOf({2.0, 10.0})), "lateral");
  EXPECT_STREQ(KindName(KindOf({0.5, 90.0})), "rotational");
  EXPECT_STREQ(KindName(KindOf({5.0, 180.0})), "both");
}

/// So many revisits in each of some bins, which lie apart.
RevisitHistogram HistogramOf(const std::vector<int>& counts) {
  RevisitHistogram histogram(8.0);
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    for (int i = 0; i < counts[bin]; ++i) {
      histogram.Add({0.5 * static_cast<double>(bin) + 0.1, 20.0 * static_cast<double>(bin) + 5.0});
    }
  }
  return histogram;
}

TEST(Divergence, IsThatOfTheFoundRelativeToAll) {
  // All of one group of two found, none of the other: ln(1 / its share).
  EXPECT_NEAR(*Divergence(HistogramOf({57, 43}), HistogramOf({57, 0})), std::log(1.0 / 0.57),
              1e-12);
  EXPECT_NEAR(*Divergence(HistogramOf({57, 43}), HistogramOf({1, 0})), std::log(1.0 / 0.57), 1e-12);
  // The paper's Oxford: 901 of 2117 loops are of the group that is lost.
  EXPECT_NEAR(*Divergence(HistogramOf({2117 - 901, 901}), HistogramOf({2117 - 901, 0})), 0.554,
              5e-4);
}

TEST(Divergence, OfAHandComputedCase) {
  // P = 3/4, 1/4; F = 1/3, 2/3.
  EXPECT_NEAR(*Divergence(HistogramOf({6, 2}), HistogramOf({1, 2})),
              1.0 / 3.0 * std::log(4.0 / 9.0) + 2.0 / 3.0 * std::log(8.0 / 3.0), 1e-12);
}

TEST(Divergence, IsZeroWhereWhatIsFoundIsSpreadAsAllAre) {
  EXPECT_NEAR(*Divergence(HistogramOf({40, 20, 4}), HistogramOf({40, 20, 4})), 0.0, 1e-12);
  EXPECT_NEAR(*Divergence(HistogramOf({40, 20, 4}), HistogramOf({10, 5, 1})), 0.0, 1e-12);
}

TEST(Divergence, IsNoneWhereNothingIsFound) {
  EXPECT_EQ(Divergence(HistogramOf({}), HistogramOf({})), std::nullopt);
  EXPECT_EQ(Divergence(HistogramOf({3}), HistogramOf({})), std::nullopt);
}

TEST(MeasureDivergences, FollowsTheCurveOfAllAndOfEachKind) {
  const std::vector<RevisitVariance> variances = {
      {0.1, 5.0}, {0.6, 5.0}, {4.0, 5.0}, {4.0, 175.0}, {30.0, 0.0}};
  const std::vector<ScoredQuery> queries = {{true, true, true, 0.8},
                                            {true, true, true, 0.6},
                                            {true, true, true, 0.4},
                                            {true, true, false, 0.9},
                                            {false, true, false, 0.5}};
  const std::vector<OperatingPoint> points = MeasurePrecisionRecall(queries).points;
  ASSERT_EQ(points.size(), 5U);  // at 0.9, 0.8, 0.6, 0.5, 0.4
  const auto measure = [&](std::optional<RevisitKind> kind) {
    return MeasureDivergences(variances, queries, points, 8.0, kind);
  };
  const std::vector<double> of_all = measure(std::nullopt);
  ASSERT_EQ(of_all.size(), 5U);
  EXPECT_TRUE(std::isnan(of_all[0])) << "nothing is found yet";
  EXPECT_NEAR(of_all[1], std::log(4.0), 1e-12);
  EXPECT_NEAR(of_all[2], std::log(2.0), 1e-12);
  EXPECT_NEAR(of_all[3], std::log(2.0), 1e-12);
  EXPECT_NEAR(of_all[4], std::log(4.0 / 3.0), 1e-12);
  const std::vector<double> of_easy = measure(RevisitKind::kEasy);
  ASSERT_EQ(of_easy.size(), 5U);
  EXPECT_NEAR(of_easy[1], std::log(2.0), 1e-12);
  EXPECT_NEAR(of_easy[4], 0.0, 1e-12);
  const std::vector<double> of_both = measure(RevisitKind::kBoth);
  ASSERT_EQ(of_both.size(), 5U);
  for (const double divergence : of_both) EXPECT_TRUE(std::isnan(divergence));
  EXPECT_TRUE(measure(RevisitKind::kRotational).empty()) << "there are none";
}

}  // namespace
}  // namespace scanloc::eval
