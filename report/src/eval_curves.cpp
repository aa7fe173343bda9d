#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "eval_figures.hpp"

namespace scanloc::report {
namespace {

/// Curves with more points than this are thinned: the page shall fit into a mail.
constexpr std::size_t kMaxPoints = 400;
constexpr const char* kRecallTitle = "recall (share of all revisits)";

/// The result as a line; no point where `point_at` has none.
template <typename PointAt>
ChartSeries LineOf(const eval::MethodResult& result, PointAt&& point_at) {
  ChartSeries line{.name = result.name};
  SetLook(result.name, &line);
  const std::size_t num_points = result.precision_recall.points.size();
  const std::size_t step = (num_points + kMaxPoints - 1) / kMaxPoints;
  for (std::size_t k = 0; k < num_points; ++k) {
    if (k % step != 0 && k + 1 != num_points) continue;
    const std::optional<Eigen::Vector3d> point = point_at(k);
    if (point) line.points.push_back(*point);
  }
  // A line of one point has no length.
  if (line.points.size() == 1) line.style = ChartSeries::Style::kMarks;
  return line;
}

/// Where methods are good the curves are told apart only if the rest is left out: what every method
/// reaches at its greatest F1 stays, and some more.
double LeastPrecisionShown(const std::vector<const eval::MethodResult*>& results) {
  double least = 1.0;
  for (const eval::MethodResult* result : results) {
    const auto& points = result->precision_recall.points;
    const auto best =
        std::ranges::max_element(points, [](const auto& a, const auto& b) { return a.f1 < b.f1; });
    if (best != points.end()) least = std::min(least, best->precision);
  }
  return least >= 0.95 ? 0.8 : least >= 0.75 ? 0.5 : 0.0;
}

EvalFigure DrawPrecisionRecall(const std::vector<const eval::MethodResult*>& results) {
  const double low = LeastPrecisionShown(results);
  // Not quite to 1, so that lines along the edges are seen.
  LineChart chart{.x = {kRecallTitle, 0.0, 1.02},
                  .y = {"precision", low, 1.0 + 0.02 * (1.0 - low)},
                  .series = {}};
  for (const eval::MethodResult* result : results) {
    const auto& points = result->precision_recall.points;
    chart.series.push_back(LineOf(*result, [&](std::size_t k) -> std::optional<Eigen::Vector3d> {
      if (points[k].precision < low) return std::nullopt;
      return Eigen::Vector3d(points[k].recall, points[k].precision, 0.0);
    }));
  }
  return FigureOf("Precision over recall",
                  low > 0.0 ? absl::StrFormat("Only precisions from %g on are shown.", low) : "",
                  chart);
}

EvalFigure DrawF1(const std::vector<const eval::MethodResult*>& results) {
  LineChart chart{.x = {kRecallTitle, 0.0, 1.02}, .y = {"F1", 0.0, 1.02}, .series = {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto& points = results[i]->precision_recall.points;
    chart.series.push_back(LineOf(*results[i], [&](std::size_t k) {
      return Eigen::Vector3d(points[k].recall, points[k].f1, 0.0);
    }));
    const auto greatest =
        std::ranges::max_element(points, [](const auto& a, const auto& b) { return a.f1 < b.f1; });
    if (greatest == points.end()) continue;
    ChartSeries dot{.style = ChartSeries::Style::kMarks, .mark_px = 9.0, .points = {}};
    SetLook(results[i]->name, &dot);
    dot.points.emplace_back(greatest->recall, greatest->f1, 0.0);
    chart.series.push_back(std::move(dot));
  }
  return FigureOf("F1 over recall", "The mark is at the greatest F1.", chart);
}

/// Of all revisits, or of those of one kind; none where none of them is found yet.
std::optional<double> DivergenceAt(const eval::MethodResult& result,
                                   std::optional<std::size_t> kind, std::size_t k) {
  const auto& divergences = kind ? result.kind_divergences[*kind] : result.divergences;
  if (k >= divergences.size() || std::isnan(divergences[k])) return std::nullopt;
  return divergences[k];
}

std::optional<EvalFigure> DrawDivergence(const std::vector<const eval::MethodResult*>& results,
                                         std::optional<std::size_t> kind) {
  LineChart chart{.x = {kRecallTitle, 0.0, 1.02},
                  .y = {"KL divergence from all revisits [nats]"},
                  .series = {}};
  double greatest = 0.0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto& points = results[i]->precision_recall.points;
    chart.series.push_back(
        LineOf(*results[i], [&](std::size_t k) -> std::optional<Eigen::Vector3d> {
          const std::optional<double> divergence = DivergenceAt(*results[i], kind, k);
          if (!divergence) return std::nullopt;
          greatest = std::max(greatest, *divergence);
          return Eigen::Vector3d(points[k].recall, *divergence, 0.0);
        }));
  }
  if (kind && std::ranges::all_of(
                  chart.series, [](const ChartSeries& series) { return series.points.empty(); })) {
    return std::nullopt;
  }
  constexpr double kLeastHeight = 0.1;
  chart.y.high = std::max(kLeastHeight, 1.05 * greatest);
  std::string title = "Divergence over recall (DR)";
  if (kind) absl::StrAppend(&title, ", ", KindTitle(*kind), " revisits");
  return FigureOf(std::move(title),
                  kind ? "Recall is that of all kinds."
                       : "How unlike the revisits found are to all there are, in kind: 0 is best.",
                  chart);
}

EvalFigure DrawReliability(const eval::MethodResult& result) {
  BarChart chart{.x = {"confidence told"},
                 .y = {"share that was right", 0.0, 1.05},
                 .count_title = "queries (right axis)",
                 .bars = {},
                 .series = {}};
  ChartSeries ideal{
      .name = "ideal", .color = colors::kGrey, .dash = 2, .width_px = 1.5, .points = {}};
  ideal.points = {{0.0, 0.0, 0.0}, {1.0, 1.0, 0.0}};
  ChartSeries line{.name = result.name, .points = {}};
  SetLook(result.name, &line);
  for (const eval::ReliabilityBin& bin : result.reliability->bins) {
    chart.bars.push_back({bin.low, bin.high, bin.num_queries});
    if (bin.num_queries > 0) line.points.emplace_back(bin.mean_confidence, bin.share_right, 0.0);
  }
  ChartSeries dots = line;
  dots.name = "";
  dots.style = ChartSeries::Style::kMarks;
  dots.mark_px = 8.0;
  chart.series = {std::move(ideal), std::move(line), std::move(dots)};
  return FigureOf(
      absl::StrCat("Reliability of the confidence, ", result.name),
      absl::StrFormat("Expected calibration error %.3f. Grey: how many queries got such a "
                      "confidence.",
                      result.reliability->expected_calibration_error),
      chart);
}

EvalFigure DrawHeatMap(const EvalReport& report) {
  eval::RevisitHistogram histogram(report.within_m);
  for (const eval::EvalQuery& query : report.queries) {
    if (query.is_revisit) histogram.Add(query.variance);
  }
  // The last bin may reach beyond within_m.
  HeatMap chart{
      .x = {"distance to the nearest place [m]", 0.0,
            histogram.num_translation_bins() * eval::RevisitHistogram::kTranslationBin_m},
      .y = {"difference in heading [deg]", 0.0,
            eval::RevisitHistogram::kNumRotationBins * eval::RevisitHistogram::kRotationBin_deg},
      .count_title = "revisits",
      .cells = {},
      .x_split = eval::kLateralFrom_m,
      .y_split = eval::kRotationalFrom_deg};
  for (int row = 0; row < eval::RevisitHistogram::kNumRotationBins; ++row) {
    chart.cells.emplace_back();
    for (int column = 0; column < histogram.num_translation_bins(); ++column) {
      chart.cells.back().push_back(histogram.count(column, row));
    }
  }
  return FigureOf(
      "Distribution of the revisits",
      absl::StrFormat("In bins of %g m x %g deg. Dashed: a revisit is lateral from %g m, "
                      "rotational from %g deg.",
                      eval::RevisitHistogram::kTranslationBin_m,
                      eval::RevisitHistogram::kRotationBin_deg, eval::kLateralFrom_m,
                      eval::kRotationalFrom_deg),
      chart);
}

}  // namespace

std::string KindTitle(std::size_t kind) {
  const auto of = static_cast<eval::RevisitKind>(kind);
  return of == eval::RevisitKind::kBoth ? "lateral and rotational" : eval::KindName(of);
}

std::vector<EvalFigure> DrawCurves(const EvalReport& report) {
  const std::vector<const eval::MethodResult*> results = ResultsWithin(report, report.within_m);
  std::vector<EvalFigure> figures = {DrawPrecisionRecall(results), DrawF1(results)};
  for (const eval::MethodResult* result : results) {
    if (result->reliability) figures.push_back(DrawReliability(*result));
  }
  figures.push_back(DrawHeatMap(report));
  figures.push_back(*DrawDivergence(results, std::nullopt));
  std::set<eval::RevisitKind> kinds;
  for (const eval::EvalQuery& query : report.queries) {
    if (query.is_revisit) kinds.insert(eval::KindOf(query.variance));
  }
  // Of one kind the figure of all is that of the kind.
  for (std::size_t kind = 0; kind < eval::kNumKinds && kinds.size() > 1; ++kind) {
    std::optional<EvalFigure> figure = DrawDivergence(results, kind);
    if (figure) figures.push_back(*std::move(figure));
  }
  return figures;
}

}  // namespace scanloc::report
