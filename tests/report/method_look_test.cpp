#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "scanloc/report/chart.hpp"

namespace scanloc::report {
namespace {

TEST(MethodLook, IsOfItsOwnForEveryMethod) {
  std::vector<std::string> names = {"auto", "m2dp", "segmatch", "net"};
  for (const std::string method : {"pc", "cc", "a-pc", "a-cc"}) {
    for (const char* variant : {"", ":10", "-key", "-trees", "-mean", "-count", "-bits",
                                "-intensity", "-radar", "-naive", "-brute", "-naive-brute"}) {
      names.push_back(method + variant);
    }
  }
  std::map<std::string, std::string> by_look;
  for (const std::string& name : names) {
    LineChart chart{.x = {"x"}, .y = {"y"}, .series = {}};
    ChartSeries series{.name = "line", .points = {{0, 0, 0}, {1, 1, 0}}};
    SetLook(name, &series);
    chart.series = {series};
    const auto [other, is_new] = by_look.emplace(Draw(chart), name);
    EXPECT_TRUE(is_new) << name << " looks like " << other->second;
  }
}

TEST(MethodLook, HasTheColourAndTheMarkOfWhatItCompares) {
  ChartSeries plain, radar;
  SetLook("a-cc", &plain);
  SetLook("a-cc-radar:10", &radar);
  EXPECT_EQ(plain.color, radar.color);
  EXPECT_EQ(plain.mark, radar.mark);
  EXPECT_NE(plain.dash, radar.dash);
}

}  // namespace
}  // namespace scanloc::report
