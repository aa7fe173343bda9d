#include <gtest/gtest.h>

#include "scanloc/report/chart.hpp"

namespace scanloc::report {
namespace {

TEST(ChartCsv, HasARowForEachPointOfSeriesWithAName) {
  LineChart chart{.x = {"x [m]"}, .y = {"share, told"}};
  chart.series.push_back({.name = "a", .points = {{1, 2, 0}, ChartSeries::kBreak, {0.5, -3, 0}}});
  chart.series.push_back({.name = "", .points = {{7, 7, 0}}});
  chart.series.push_back({.name = "b",
                          .style = ChartSeries::Style::kSegments,
                          .points = {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {3, 3, 0}}});
  EXPECT_EQ(AsCsv(chart),
            "series,part,x [m],\"share, told\"\n"
            "a,0,1,2\na,1,0.5,-3\n"
            "b,0,0,0\nb,0,1,1\nb,1,2,2\nb,1,3,3\n");
  EXPECT_EQ(
      AsCsv(SpaceChart{.x = {"x"}, .y = {"y"}, .z = {"z"}, .series = chart.series}).substr(0, 26),
      "series,part,x,y,z\na,0,1,2,");
}

TEST(ChartCsv, HasARowForEachCellAndBar) {
  EXPECT_EQ(
      AsCsv(HeatMap{
          .x = {"x", 0, 4}, .y = {"y", 0, 10}, .count_title = "n", .cells = {{1, 2}, {3, 4}}}),
      "\"x, from\",\"x, to\",\"y, from\",\"y, to\",n\n"
      "0,2,0,5,1\n2,4,0,5,2\n0,2,5,10,3\n2,4,5,10,4\n");
  EXPECT_EQ(AsCsv(BarChart{.x = {"x"}, .y = {"y"}, .count_title = "n", .bars = {{0, 0.5, 9}}}),
            "series,part,x,y\nn,0,0.25,9\n");
}

}  // namespace
}  // namespace scanloc::report
