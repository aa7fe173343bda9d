#include "scanloc/report/drive_report.hpp"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "deviations.hpp"
#include "page.hpp"
#include "plan_axes.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/report/chart.hpp"
#include "scanloc/report/csv.hpp"
#include "svg.hpp"

namespace scanloc::report {
namespace {

using Style = ChartSeries::Style;

constexpr std::size_t kMaxLoopsInPage = 200;

std::string FromText(const ReportedLoop& loop) { return loop.from.empty() ? "map" : loop.from; }

std::string ErrorsText(const char* when, const eval::TrajectoryErrors& errors) {
  return absl::StrFormat(
      "  error %-6s  APE rmse %.3f m (mean %.3f, max %.3f), %.3f deg; RPE a step %.4f m, per 100 m "
      "%.3f m\n",
      when, errors.ape_m.rmse, errors.ape_m.mean, errors.ape_m.max, errors.ape_deg.rmse,
      errors.rpe_m.rmse, errors.rpe_100m_m.rmse);
}

Json StatisticsAsJson(const eval::ErrorStatistics& statistics) {
  if (statistics.num == 0) return nullptr;
  return {{"rmse", statistics.rmse},
          {"mean", statistics.mean},
          {"median", statistics.median},
          {"max", statistics.max},
          {"num", statistics.num}};
}

Json ErrorsAsJson(const std::optional<eval::TrajectoryErrors>& errors) {
  if (!errors) return nullptr;
  return {{"ape_m", StatisticsAsJson(errors->ape_m)},
          {"ape_deg", StatisticsAsJson(errors->ape_deg)},
          {"rpe_m", StatisticsAsJson(errors->rpe_m)},
          {"rpe_deg", StatisticsAsJson(errors->rpe_deg)},
          {"rpe_100m_m", StatisticsAsJson(errors->rpe_100m_m)}};
}

Json Vector(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

ChartSeries PathOf(const char* name, const std::vector<Pose>& poses, const Pose& T_chart_poses,
                   const char* color, int dash) {
  ChartSeries path{.name = name, .color = color, .dash = dash, .points = {}};
  for (const Pose& pose : poses) {
    const Eigen::Vector3d at = T_chart_poses * pose.translation();
    path.points.emplace_back(at.x(), at.y(), 0.0);
  }
  return path;
}

ChartSeries LoopsOf(const DriveReport& report, bool is_on) {
  ChartSeries segments{.style = Style::kSegments,
                       .color = is_on ? colors::kGreen : colors::kVermilion,
                       .width_px = is_on ? 2.0 : 1.0,
                       .points = {}};
  for (const ReportedLoop& loop : report.loops) {
    if (loop.is_on != is_on || !loop.from_scan) continue;
    for (const std::size_t scan : {*loop.from_scan, loop.to_scan}) {
      const Eigen::Vector3d& at = report.after[scan].translation();
      segments.points.emplace_back(at.x(), at.y(), 0.0);
    }
  }
  segments.name = absl::StrFormat("loops %s: %d", is_on ? "that hold" : "switched off",
                                  segments.points.size() / 2);
  return segments;
}

/// All in the frame of the result; the truth as it is laid on the result.
std::string DrawTrajectories(const DriveReport& report) {
  LineChart chart{.has_equal_scales = true, .width_px = kPictureWidth_px};
  // Odometry has a frame of its own: it begins where the result does.
  const Pose T_after_before = report.after.front() * report.before.front().inverse();
  chart.series.push_back(PathOf("before", report.before, T_after_before, colors::kOrange, 2));
  if (report.errors_after) {
    chart.series.push_back(PathOf(
        "truth", report.truth, report.errors_after->T_truth_estimate.inverse(), colors::kGrey, 1));
    chart.series.back().width_px = 5.0;
  }
  chart.series.push_back(PathOf("after", report.after, Pose::Identity(), colors::kBlue, 1));
  chart.series.push_back(LoopsOf(report, true));
  chart.series.push_back(LoopsOf(report, false));
  SetPlanAxes(&chart);
  return Draw(chart);
}

std::string DrawResiduals(const DriveReport& report) {
  LineChart chart{.x = {"scan", 0.0, std::max(1.0, static_cast<double>(report.after.size()))},
                  .width_px = kPictureWidth_px};
  double most_m = 0.1;
  for (const bool is_on : {true, false}) {
    ChartSeries marks{.name = is_on ? "holds" : "switched off (at most the axis)",
                      .style = Style::kMarks,
                      .color = is_on ? colors::kGreen : colors::kVermilion,
                      .mark = is_on ? Mark::kDisc : Mark::kCross,
                      .points = {}};
    for (const ReportedLoop& loop : report.loops) {
      if (loop.is_on != is_on) continue;
      if (is_on) most_m = std::max(most_m, 1.1 * loop.error_m);
      marks.points.emplace_back(static_cast<double>(loop.to_scan),
                                is_on ? loop.error_m : std::min(loop.error_m, most_m), 0.0);
      marks.tips.push_back(
          absl::StrFormat("%s to %s: %.3f m", FromText(loop), loop.to, loop.error_m));
    }
    chart.series.push_back(std::move(marks));
  }
  chart.y = {"residual [m]", 0.0, most_m};
  return Draw(chart);
}

std::vector<std::string> LoopFields(const ReportedLoop& loop) {
  return {FromText(loop),
          loop.to,
          loop.is_on ? "1" : "0",
          FixedText(loop.confidence, 4),
          FixedText(loop.error_m, 4),
          FixedText(loop.error_deg, 4),
          FixedText(loop.chi2, 2)};
}

const std::vector<std::string>& LoopColumns() {
  static const std::vector<std::string> columns = {"from",    "to",        "is_on", "confidence",
                                                   "error_m", "error_deg", "chi2"};
  return columns;
}

std::string LoopTable(const DriveReport& report) {
  std::vector<const ReportedLoop*> worst;
  for (const ReportedLoop& loop : report.loops) worst.push_back(&loop);
  std::ranges::stable_sort(worst, [](const auto* a, const auto* b) {
    return std::pair(a->is_on, -a->chi2) < std::pair(b->is_on, -b->chi2);
  });
  std::vector<std::vector<std::string>> rows;
  for (const ReportedLoop* loop : worst) {
    if (rows.size() == kMaxLoopsInPage) break;
    rows.push_back(LoopFields(*loop));
  }
  return HtmlTable(LoopColumns(), rows);
}

}  // namespace

double DriveReport::length_m() const {
  double length_m = 0.0;
  for (std::size_t i = 1; i < after.size(); ++i) {
    length_m += (after[i].translation() - after[i - 1].translation()).norm();
  }
  return length_m;
}

std::size_t DriveReport::num_on() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(loops, [](const ReportedLoop& l) { return l.is_on; }));
}

std::string DriveAsText(const DriveReport& report) {
  std::string text = absl::StrFormat(
      "%s: %d scans, %.0f m\n"
      "  found         %d of %d scans that were looked up, in %d passes\n"
      "  hold          %d; %d contradict the rest and were switched off\n"
      "  odometry      every metre is %+.4f m off ahead, %+.4f m to the left, %+.4f m up, and "
      "turns "
      "%+.4f deg; by chance %.4f m and %.4f deg a √metre\n",
      Printable(report.title), report.after.size(), report.length_m(), report.loops.size(),
      report.num_looked_at, report.num_passes, report.num_on(),
      report.loops.size() - report.num_on(), -report.drift_m_m.x(), -report.drift_m_m.y(),
      -report.drift_m_m.z(), -report.drift_rad_m.z() * kDegPerRad, report.noise_m,
      report.noise_rad * kDegPerRad);
  if (report.errors_before) text += ErrorsText("before", *report.errors_before);
  if (report.errors_after) text += ErrorsText("after", *report.errors_after);
  return text;
}

Json DriveAsJson(const DriveReport& report) {
  Json json = {{"num_scans", report.after.size()},
               {"length_m", report.length_m()},
               {"num_looked_up", report.num_looked_at},
               {"num_passes", report.num_passes},
               {"num_loops", report.loops.size()},
               {"num_loops_on", report.num_on()},
               {"num_loops_off", report.loops.size() - report.num_on()},
               {"odometry",
                {{"drift_m_per_m", Vector(report.drift_m_m)},
                 {"drift_rad_per_m", Vector(report.drift_rad_m)},
                 {"noise_m", report.noise_m},
                 {"noise_rad", report.noise_rad}}},
               {"errors_before", ErrorsAsJson(report.errors_before)},
               {"errors_after", ErrorsAsJson(report.errors_after)}};
  json["loops"] = Json::array();
  for (const ReportedLoop& loop : report.loops) {
    json["loops"].push_back({{"from", loop.from.empty() ? Json(nullptr) : Json(loop.from)},
                             {"to", loop.to},
                             {"is_on", loop.is_on},
                             {"confidence", loop.confidence},
                             {"error_m", loop.error_m},
                             {"error_deg", loop.error_deg},
                             {"chi2", loop.chi2}});
  }
  return json;
}

std::string LoopsAsCsv(const DriveReport& report) {
  std::string csv = CsvRow(LoopColumns());
  for (const ReportedLoop& loop : report.loops) csv += CsvRow(LoopFields(loop));
  return csv;
}

std::string DriveAsHtml(const DriveReport& report) {
  return absl::StrCat(
      PageHead(report.title), "<h1>", XmlEscaped(report.title), "</h1>\n<pre>",
      XmlEscaped(DriveAsText(report)), "</pre>\n<h2>Trajectory</h2>\n<figure>",
      DrawTrajectories(report), "</figure>\n<h2>Residuals of what was found</h2>\n<figure>",
      DrawResiduals(report), "</figure>\n<h2>Worst first (loops.csv has all)</h2>\n",
      LoopTable(report), "</body></html>\n");
}

}  // namespace scanloc::report
