#include "scanloc/report/change_report.hpp"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "plan_axes.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/report/chart.hpp"

namespace scanloc::report {
namespace {

using Side = std::vector<ReportedChange>;

std::size_t Count(const Side& side, const std::string& change) {
  return static_cast<std::size_t>(
      std::ranges::count_if(side, [&](const ReportedChange& one) { return one.change == change; }));
}

std::string SideAsText(const std::string& name, const Side& side, const char* unseen) {
  return absl::StrFormat("  %s: %d the same, %d changed, %d %s\n", Printable(name),
                         Count(side, "same"), Count(side, "changed"), Count(side, "unseen"),
                         unseen);
}

Json SideAsJson(const std::string& name, const Side& side) {
  Json json = {{"name", name},
               {"num", side.size()},
               {"num_same", Count(side, "same")},
               {"num_changed", Count(side, "changed")},
               {"num_unseen", Count(side, "unseen")}};
  json["places"] = Json::array();
  for (const ReportedChange& one : side) {
    const Eigen::Vector3d at = one.T_map_scan.translation();
    json["places"].push_back({{"place", one.number},
                              {"scan", one.scan},
                              {"session", one.session},
                              {"x", at.x()},
                              {"y", at.y()},
                              {"z", at.z()},
                              {"change", one.change},
                              {"agreement", one.agreement}});
  }
  return json;
}

void AddFeatures(const char* side_name, const Side& side, Json* features) {
  for (const ReportedChange& one : side) {
    const Eigen::Vector3d at = one.T_map_scan.translation();
    features->push_back(
        {{"type", "Feature"},
         {"geometry", {{"type", "Point"}, {"coordinates", Json::array({at.x(), at.y(), at.z()})}}},
         {"properties",
          {{"side", side_name},
           {"place", one.number},
           {"scan", one.scan},
           {"session", one.session},
           {"change", one.change},
           {"agreement", one.agreement}}}});
  }
}

ChartSeries MarksOf(const std::string& name, const Side& side, const std::string& change,
                    const char* color, Mark mark) {
  ChartSeries marks{.name = absl::StrFormat("%s: %d", name, Count(side, change)),
                    .style = ChartSeries::Style::kMarks,
                    .color = color,
                    .mark = mark,
                    .points = {}};
  for (const ReportedChange& one : side) {
    if (one.change != change) continue;
    const Eigen::Vector3d at = one.T_map_scan.translation();
    marks.points.emplace_back(at.x(), at.y(), 0.0);
    marks.tips.push_back(
        absl::StrFormat("%d %s: agreement %.2f", one.number, one.scan, one.agreement));
  }
  return marks;
}

}  // namespace

std::string ChangesAsText(const ChangeReport& report) {
  return absl::StrCat("compared ", Printable(report.before_name), " with ",
                      Printable(report.after_name), "\n",
                      SideAsText(report.before_name, report.before, "not visited again"),
                      SideAsText(report.after_name, report.after, "where the map has nothing: new"),
                      "  scanloc refresh replaces what has changed\n");
}

Json ChangesAsJson(const ChangeReport& report) {
  return {{"before", SideAsJson(report.before_name, report.before)},
          {"after", SideAsJson(report.after_name, report.after)}};
}

Json ChangesAsGeoJson(const ChangeReport& report) {
  Json json = {{"type", "FeatureCollection"},
               {"note", "coordinates are metres in the frame of the map"}};
  json["features"] = Json::array();
  AddFeatures("before", report.before, &json["features"]);
  AddFeatures("after", report.after, &json["features"]);
  return json;
}

std::string DrawChanges(const ChangeReport& report) {
  LineChart chart{
      .series = {MarksOf("the same", report.before, "same", colors::kGrey, Mark::kDisc),
                 MarksOf("not visited again", report.before, "unseen", colors::kSky, Mark::kRing),
                 MarksOf("new", report.after, "unseen", colors::kGreen, Mark::kRing),
                 MarksOf("changed", report.before, "changed", colors::kVermilion, Mark::kCross)},
      .has_equal_scales = true,
      .title = absl::StrCat(report.before_name, " and ", report.after_name),
      .width_px = kPictureWidth_px};
  SetPlanAxes(&chart);
  return Draw(chart);
}

}  // namespace scanloc::report
