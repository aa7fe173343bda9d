#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "cli/chart.hpp"
#include "cli/eval_report.hpp"

namespace scanloc::cli {
namespace {

/// Curves with more points than this are thinned: the page shall fit into a mail.
constexpr std::size_t kMaxPoints = 400;

std::string Escaped(const std::string& text) {
  return absl::StrReplaceAll(text, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}});
}

template <typename PointAt>
ChartLine LineOf(const std::string& name, std::size_t num_points, PointAt&& point_at) {
  ChartLine line{.name = name};
  const std::size_t step = std::max<std::size_t>(1, num_points / kMaxPoints);
  const auto append = [&](std::size_t i) {
    const Eigen::Vector2d point = point_at(i);
    if (point.allFinite()) line.points.push_back(point);
  };
  for (std::size_t i = 0; i < num_points; i += step) append(i);
  if (num_points > 0) append(num_points - 1);
  return line;
}

const char* KindTitle(eval::RevisitKind kind) {
  return kind == eval::RevisitKind::kBoth ? "lateral and rotational" : eval::KindName(kind);
}

/// Those that the charts are drawn of.
std::vector<MethodResult> MainResults(const EvalReport& report) {
  std::vector<MethodResult> results;
  for (const MethodResult& result : report.results) {
    if (result.within_m == report.within_m) results.push_back(result);
  }
  return results;
}

std::string PrecisionRecallChart(const EvalReport& report) {
  std::vector<ChartLine> lines;
  for (const MethodResult& result : report.results) {
    const auto& points = result.precision_recall.points;
    lines.push_back(LineOf(result.name, points.size(), [&](std::size_t i) {
      return Eigen::Vector2d(points[i].recall, points[i].precision);
    }));
  }
  return DrawChart("Precision over recall", {"recall (of all revisits)"}, {"precision"}, lines);
}

std::string F1Chart(const EvalReport& report) {
  std::vector<ChartLine> lines;
  for (const MethodResult& result : report.results) {
    const auto& points = result.precision_recall.points;
    lines.push_back(LineOf(result.name, points.size(), [&](std::size_t i) {
      return Eigen::Vector2d(points[i].recall, points[i].f1);
    }));
  }
  return DrawChart("F1 over recall", {"recall (of all revisits)"}, {"F1"}, lines);
}

/// Of all revisits, or of those of one kind; nothing where there are none of it.
std::string DivergenceChart(const EvalReport& report, std::optional<std::size_t> kind) {
  std::vector<ChartLine> lines;
  double greatest = 0.0;
  for (const MethodResult& result : report.results) {
    const auto& points = result.precision_recall.points;
    const auto& divergences = kind ? result.kind_divergences[*kind] : result.divergences;
    if (kind && divergences.empty()) continue;
    for (const double divergence : divergences) greatest = std::max(greatest, divergence);
    lines.push_back(LineOf(result.name, points.size(), [&](std::size_t i) {
      return Eigen::Vector2d(points[i].recall, divergences[i]);
    }));
  }
  if (lines.empty()) return "";
  return DrawChart(kind ? absl::StrCat("DR of revisits that are ",
                                       KindTitle(static_cast<eval::RevisitKind>(*kind)))
                        : "Distribution of what was found (DR)",
                   {"recall (of all revisits)"},
                   {"KL divergence from all [nats]", 0.0, greatest > 0.5 ? 1.0 : 0.5}, lines);
}

std::string ReliabilityChart(const EvalReport& report) {
  std::vector<ChartLine> lines = {{"ideal", {{0.0, 0.0}, {1.0, 1.0}}}};
  for (const MethodResult& result : report.results) {
    if (!result.reliability) continue;
    ChartLine line{.name = result.name, .has_dots = true};
    for (const eval::ReliabilityBin& bin : result.reliability->bins) {
      if (bin.num_queries > 0) line.points.emplace_back(bin.mean_confidence, bin.share_right);
    }
    lines.push_back(std::move(line));
  }
  if (lines.size() == 1) return "";
  return DrawChart("Reliability of the confidence", {"confidence"}, {"share that is right"}, lines);
}

std::string RevisitHeatMap(const EvalReport& report) {
  eval::RevisitHistogram histogram(report.within_m);
  for (const EvalQuery& query : report.queries) {
    if (query.is_revisit) histogram.Add(query.variance);
  }
  std::vector<std::vector<double>> cells(
      static_cast<std::size_t>(eval::RevisitHistogram::kNumRotationBins));
  for (std::size_t row = 0; row < cells.size(); ++row) {
    for (int column = 0; column < histogram.num_translation_bins(); ++column) {
      cells[row].push_back(static_cast<double>(histogram.count(column, static_cast<int>(row))));
    }
  }
  return DrawHeatMap("How the revisits differ from the map",
                     {"distance to the nearest place [m]", 0.0, report.within_m},
                     {"difference in heading [deg]", 0.0, 180.0}, cells);
}

std::vector<PicturedQuery> PicturesOf(const EvalReport& report, const MethodResult& result) {
  std::vector<PicturedQuery> pictured;
  for (std::size_t i = 0; i < report.queries.size(); ++i) {
    const EvalQuery& query = report.queries[i];
    const eval::ScoredQuery& scored = result.scored[i];
    const bool is_accepted = scored.has_match && scored.score >= result.threshold_at_f1_max;
    if (!query.T_map_true && !is_accepted) continue;  // rightly not recognised, and nowhere
    PicturedQuery picture{.query = query.name};
    picture.verdict = !is_accepted      ? Verdict::kNotRecognized
                      : scored.is_right ? Verdict::kRight
                                        : Verdict::kWrong;
    if (is_accepted) picture.answered = result.matched_m[i];
    if (query.T_map_true) picture.truth = query.T_map_true->translation().head<2>();
    pictured.push_back(std::move(picture));
  }
  return pictured;
}

/// The paper's match graph: the queries over the map, time going up, each joined to its match.
std::string MatchGraph(const EvalReport& report, const MethodResult& result) {
  Eigen::AlignedBox2d extent_m;
  for (const PicturedPlace& place : report.places) extent_m.extend(place.position);
  if (extent_m.isEmpty()) return "";
  // Seen from a height: y is foreshortened, and the time of a query lifts it.
  const double rise_m = 0.6 * extent_m.sizes().maxCoeff();
  const auto lifted = [&](const Eigen::Vector2d& m, double share) {
    return Eigen::Vector2d(m.x() + 0.35 * (m.y() - extent_m.min().y()),
                           0.35 * (m.y() - extent_m.min().y()) + share * rise_m);
  };
  ChartLine map{.name = "map"};
  for (const PicturedPlace& place : report.places) map.points.push_back(lifted(place.position, 0));
  std::vector<ChartLine> lines = {map, {.name = "queries, later ones higher"}};
  const auto count = static_cast<double>(std::max<std::size_t>(1, report.queries.size()));
  for (std::size_t i = 0; i < report.queries.size(); ++i) {
    const EvalQuery& query = report.queries[i];
    if (!query.T_map_true) continue;
    const double share = 0.3 + 0.7 * static_cast<double>(i) / count;
    lines[1].points.push_back(lifted(query.T_map_true->translation().head<2>(), share));
  }
  double low_x = 1e18, high_x = -1e18, high_y = 0.0;
  for (const ChartLine& line : lines) {
    for (const Eigen::Vector2d& p : line.points) {
      low_x = std::min(low_x, p.x());
      high_x = std::max(high_x, p.x());
      high_y = std::max(high_y, p.y());
    }
  }
  // Joins: down to the match and back, so that one line draws all of a kind.
  std::array<ChartLine, 2> joins = {ChartLine{"right match"}, ChartLine{"wrong match"}};
  std::vector<ChartLine> all = lines;
  const std::size_t step = std::max<std::size_t>(1, report.queries.size() / 150);
  for (std::size_t i = 0; i < report.queries.size(); i += step) {
    const EvalQuery& query = report.queries[i];
    const eval::ScoredQuery& scored = result.scored[i];
    if (!query.T_map_true || !scored.has_match || scored.score < result.threshold_at_f1_max) {
      continue;
    }
    const double share = 0.3 + 0.7 * static_cast<double>(i) / count;
    const Eigen::Vector2d from = lifted(query.T_map_true->translation().head<2>(), share);
    ChartLine& join = joins[scored.is_right ? 0 : 1];
    if (join.points.empty()) join.points.push_back(from);
    join.points.push_back(from);
    join.points.push_back(lifted(result.matched_m[i], 0.0));
    join.points.push_back(from);
  }
  for (ChartLine& join : joins) all.push_back(std::move(join));
  return DrawChart(absl::StrCat("Matches of ", result.name, ", time going up"),
                   {"east, seen from a height [m]", low_x, high_x},
                   {"time", 0.0, std::max(high_y, 1.0)}, all);
}

}  // namespace

std::string ResultTable(const std::vector<MethodResult>& results, double within_m) {
  std::string html = "<table><tr>";
  for (const std::string& column : EvalColumns()) absl::StrAppend(&html, "<th>", column, "</th>");
  html += "</tr>\n";
  for (const MethodResult& result : results) {
    if (result.within_m != within_m) continue;
    html += "<tr>";
    for (const std::string& cell : EvalRow(result)) {
      absl::StrAppend(&html, "<td>", Escaped(cell), "</td>");
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string EvalAsHtml(const EvalReport& whole) {
  EvalReport report = whole;
  report.results = MainResults(whole);
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<title>scanloc evaluation</title>\n<style>\n"
      "body { font: 15px/1.5 sans-serif; margin: 2em auto; max-width: 1340px; color: #222 }\n"
      "table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .3em .8em;"
      " text-align: right; border-bottom: 1px solid #ddd } td:first-child, th:first-child {"
      " text-align: left }\n"
      ".charts { display: flex; flex-wrap: wrap; gap: 16px } .charts svg, .wide svg { border: 1px"
      " solid #ddd; height: auto; max-width: 100% }\n</style></head><body>\n";
  absl::StrAppend(&html, "<h1>scanloc evaluation</h1>\n<p>Map <code>", Escaped(report.map),
                  "</code>, content id <code>", Escaped(report.content_id), "</code>. ",
                  Escaped(EvalSummary(report)), ". A match is right if its place lies within ",
                  report.within_m, " m of the query's true position.</p>\n",
                  ResultTable(whole.results, whole.within_m));
  double told_m = whole.within_m;
  for (const MethodResult& result : whole.results) {
    if (result.within_m == told_m) continue;
    told_m = result.within_m;
    absl::StrAppend(&html, "<h2>Within ", told_m, " m (", result.first_right.size(),
                    " revisits)</h2>\n", ResultTable(whole.results, told_m));
  }
  html +=
      "<p>AUC: area under precision over recall. P@F1, R@F1: precision and recall at the greatest "
      "F1. R@P100: recall at 100 % precision. EP: "
      "extended precision. KL: divergence of the revisits found from all, at the greatest F1. ECE: "
      "expected calibration error. pos, lat, yaw: median errors of right matches. ms: mean time to "
      "describe and search, one thread.</p>\n<div class=\"charts\">\n";
  for (const std::string& chart :
       {PrecisionRecallChart(report), F1Chart(report), ReliabilityChart(report),
        RevisitHeatMap(report), DivergenceChart(report, std::nullopt), DivergenceChart(report, 0),
        DivergenceChart(report, 1), DivergenceChart(report, 2), DivergenceChart(report, 3)}) {
    absl::StrAppend(&html, chart, "\n");
  }
  if (!report.results.empty()) {
    absl::StrAppend(&html, MatchGraph(report, report.results.front()), "\n");
  }
  html += "</div>\n<div class=\"wide\">\n";
  for (const MethodResult& result : report.results) {
    absl::StrAppend(&html,
                    DrawMapPicture(absl::StrCat("Matches of ", result.name, " at its greatest F1"),
                                   report.places, PicturesOf(report, result)),
                    "\n");
  }
  return html + "</div>\n</body></html>\n";
}

}  // namespace scanloc::cli
