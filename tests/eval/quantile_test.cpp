#include "scanloc/eval/quantile.hpp"

#include <gtest/gtest.h>

namespace scanloc::eval {
namespace {

TEST(Quantile, IsLinearBetweenNeighbours) {
  EXPECT_EQ(Quantile({3.0}, 0.9), 3.0);
  EXPECT_EQ(Quantile({9.0, 1.0, 5.0}, 0.5), 5.0);
  EXPECT_EQ(Quantile({9.0, 1.0, 5.0, 2.0}, 0.5), 3.5);
  EXPECT_EQ(Quantile({0.0, 10.0}, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(*Quantile({5.0, 4.0, 3.0, 2.0, 1.0}, 0.9), 4.6);
  EXPECT_EQ(Quantile({2.0, 1.0}, 0.0), 1.0);
  EXPECT_EQ(Quantile({2.0, 1.0}, 1.0), 2.0);
}

TEST(Quantile, OfNothingIsNone) {
  EXPECT_EQ(Quantile({}, 0.5), std::nullopt);
  EXPECT_EQ(Mean({}), std::nullopt);
  EXPECT_FALSE(Summarize({}).has_value());
}

TEST(Summarize, TellsMedianMeanAndNineInTen) {
  const std::optional<ErrorSummary> summary = Summarize({10.0, 0.0, 2.0, 0.0});
  ASSERT_TRUE(summary.has_value());
  EXPECT_EQ(summary->median, 1.0);
  EXPECT_EQ(summary->mean, 3.0);
  EXPECT_DOUBLE_EQ(summary->p90, 2.0 + 0.7 * 8.0);
}

}  // namespace
}  // namespace scanloc::eval
