#include "scanloc/eval/recall_distribution.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(Divergence, OfAHandComputedCase) {
  RevisitHistogram all(8.0);
  RevisitHistogram found(8.0);
  for (int i = 0; i < 3; ++i) all.Add({0.1, 5.0});
  all.Add({3.0, 175.0});
  found.Add({0.1, 5.0});
  // P = 3/4, 1/4; Q = (1 + 1/2) / 2, (0 + 1/2) / 2.
  EXPECT_NEAR(Divergence(all, found), 0.75 * std::log(0.75 / 0.75) + 0.25 * std::log(0.25 / 0.25),
              1e-12);
  found.Add({0.1, 5.0});
  EXPECT_NEAR(Divergence(all, found),
              0.75 * std::log(0.75 / (2.5 / 3.0)) + 0.25 * std::log(0.25 / (0.5 / 3.0)), 1e-12);
}

TEST(Divergence, IsLessWhereAllKindsAreFoundThanWhereOneIs) {
  RevisitHistogram all(8.0);
  RevisitHistogram one_kind(8.0);
  RevisitHistogram spread(8.0);
  for (int i = 0; i < 100; ++i) {
    all.Add({0.1, 5.0});
    all.Add({4.0, 175.0});
    one_kind.Add({0.1, 5.0});
    if (i % 4 == 0) spread.Add({0.1, 5.0});
    if (i % 4 == 0) spread.Add({4.0, 175.0});
  }
  EXPECT_GT(Divergence(all, one_kind), 1.0);
  EXPECT_LT(Divergence(all, spread), 0.01);
  EXPECT_LT(Divergence(all, all), 0.001);
}

TEST(Divergence, WithoutRevisitsOrFindsIsDefined) {
  const RevisitHistogram none(8.0);
  EXPECT_EQ(Divergence(none, none), 0.0);
  RevisitHistogram all(8.0);
  all.Add({0.1, 5.0});
  EXPECT_TRUE(std::isfinite(Divergence(all, none)));
}

}  // namespace
}  // namespace scanloc::eval
