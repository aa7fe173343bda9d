#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "eval_figures.hpp"
#include "sorted_queries.hpp"

namespace scanloc::report {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Style = ChartSeries::Style;

/// Paths with more points than this are thinned.
constexpr std::size_t kMaxPathPoints = 300;
/// So many right matches are drawn as lines in one chart; wrong ones all.
constexpr std::size_t kMaxRight = 200;
/// Of the longest side of a chart: marks of a kind that are nearer than this hide each other.
constexpr double kMarkShare = 0.012;
constexpr std::array<const char*, eval::kNumKinds> kShortKinds = {"easy", "lateral", "rotational",
                                                                  "lat. + rot."};
constexpr std::array<Mark, eval::kNumKinds> kFullMarks = {Mark::kDisc, Mark::kTriangle,
                                                          Mark::kSquare, Mark::kDiamond};
constexpr std::array<Mark, eval::kNumKinds> kOpenMarks = {Mark::kRing, Mark::kOpenTriangle,
                                                          Mark::kOpenSquare, Mark::kOpenDiamond};

/// So that they are not in the legend.
void DropEmpty(std::vector<ChartSeries>* series) {
  std::erase_if(*series, [](const ChartSeries& one) { return one.points.empty(); });
}

class MatchCharts {
 public:
  MatchCharts(const EvalReport& report, const eval::MethodResult& result)
      : report_(report), result_(result) {
    SetFrame();
    SetHeights();
  }

  EvalFigure DrawTrajectory() {
    const std::optional<double> threshold = ThresholdAtF1Max(result_);
    const SortedQueries sorted = SortQueries(report_, result_, threshold);
    LineChart chart{.x = Axis('x'), .y = Axis('y'), .series = {}, .has_equal_scales = true};
    chart.series.push_back(in_session_ ? QueryPath() : MapPath());
    if (in_session_) chart.series.back().color = "#a0a0a0";
    for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
      chart.series.push_back({.name = absl::StrCat("missed: ", kShortKinds[kind]),
                              .style = Style::kMarks,
                              .color = colors::kBlack,
                              .width_px = 1.0,
                              .mark = kOpenMarks[kind],
                              .mark_px = 7.0,
                              .points = MarksAt(sorted.missed[kind])});
    }
    for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
      chart.series.push_back({.name = absl::StrCat("right: ", kShortKinds[kind]),
                              .style = Style::kMarks,
                              .color = colors::kGreen,
                              .mark = kFullMarks[kind],
                              .mark_px = 6.0,
                              .points = MarksAt(sorted.right[kind])});
    }
    ChartSeries wrong{.name = "wrong: to its match",
                      .style = Style::kSegments,
                      .color = colors::kVermilion,
                      .width_px = 1.0,
                      .points = {}};
    for (const std::size_t i : sorted.wrong) {
      const Vector2d from_m = TruePosition(i);
      const Vector2d to_m = MatchedPosition(i);
      wrong.points.emplace_back(from_m.x(), from_m.y(), 0.0);
      wrong.points.emplace_back(to_m.x(), to_m.y(), 0.0);
    }
    ChartSeries crosses{.name = "wrong: query",
                        .style = Style::kMarks,
                        .color = colors::kVermilion,
                        .width_px = 1.5,
                        .mark = Mark::kCross,
                        .mark_px = 8.0,
                        .points = MarksAt(sorted.wrong)};
    chart.series.push_back(std::move(wrong));
    chart.series.push_back(std::move(crosses));
    DropEmpty(&chart.series);
    return FigureOf(absl::StrCat("Matches of ", result_.name, " from above, at its greatest F1"),
                    Note(sorted, true), chart);
  }
  EvalFigure DrawGraph(const std::string& title, std::optional<double> threshold) {
    const SortedQueries sorted = SortQueries(report_, result_, threshold);
    SpaceChart chart{.x = Axis('x'),
                     .y = Axis('y'),
                     .z = {height_title_, base_, top_},
                     .tick_from = 0.0,
                     .series = {}};
    if (!in_session_) chart.series.push_back(MapPath());
    ChartSeries easy{.name = "right, easy",
                     .style = Style::kSegments,
                     .color = colors::kGreen,
                     .width_px = 0.5,
                     .points = {}};
    ChartSeries varied = easy;
    varied.name = "right, lateral or rotational";
    varied.width_px = 1.0;
    ChartSeries wrong = easy;
    wrong.name = "wrong";
    wrong.color = colors::kVermilion;
    wrong.dash = 2;
    wrong.width_px = 1.0;
    const std::size_t step = (CountAll(sorted.right) + kMaxRight - 1) / kMaxRight;
    for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
      const bool is_easy = static_cast<eval::RevisitKind>(kind) == eval::RevisitKind::kEasy;
      for (std::size_t k = 0; k < sorted.right[kind].size(); k += step) {
        ChartSeries& right = is_easy ? easy : varied;
        right.points.push_back(Lifted(sorted.right[kind][k]));
        right.points.push_back(Matched(sorted.right[kind][k]));
      }
    }
    for (const std::size_t i : sorted.wrong) {
      wrong.points.push_back(Lifted(i));
      wrong.points.push_back(Matched(i));
    }
    for (ChartSeries* series : {&easy, &varied, &wrong}) chart.series.push_back(std::move(*series));
    chart.series.push_back(QueryPath());
    DropEmpty(&chart.series);
    std::string note = threshold ? Note(sorted, false) : "No match is accepted.";
    if (step > 1) absl::StrAppend(&note, " One right match in ", step, " is drawn.");
    return FigureOf(title, std::move(note), chart);
  }

 private:
  void SetFrame() {
    Eigen::AlignedBox2d extent_m;
    for (const PicturedPlace& place : report_.places) extent_m.extend(place.position);
    for (std::size_t i = 0; i < report_.queries.size(); ++i) {
      const eval::EvalQuery& query = report_.queries[i];
      if (!query.T_map_true) continue;
      extent_m.extend(query.T_map_true->translation().head<2>());
      in_session_ = in_session_ || query.sees_until_ns.has_value();
    }
    if (extent_m.isEmpty()) extent_m.extend(Vector2d(0.0, 0.0));
    // Wide enough for scales; and numbers at the axes are short also far from the origin.
    constexpr double kLeastSide_m = 20.0;
    constexpr double kFar_m = 1e4;
    const Vector2d border_m =
        (Vector2d::Constant(kLeastSide_m) - extent_m.sizes()).cwiseMax(0.0) / 2.0 +
        Vector2d::Constant(0.04 * extent_m.sizes().maxCoeff());
    if (extent_m.min().cwiseAbs().maxCoeff() > kFar_m) {
      origin_m_ = (extent_m.min() / 1000.0).array().floor() * 1000.0;
    }
    extent_m_ = {Vector2d(extent_m.min() - border_m - origin_m_),
                 Vector2d(extent_m.max() + border_m - origin_m_)};
  }
  void SetHeights() {
    std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
    std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
    for (const eval::EvalQuery& query : report_.queries) {
      if (!query.T_map_true) continue;
      first_ns = std::min(first_ns, query.stamp_ns);
      last_ns = std::max(last_ns, query.stamp_ns);
    }
    const bool has_times = first_ns < last_ns;
    height_title_ = has_times ? "time since the first query [s]" : "number of the query (no times)";
    double greatest = 0.0;
    for (std::size_t i = 0; i < report_.queries.size(); ++i) {
      const eval::EvalQuery& query = report_.queries[i];
      height_.push_back(has_times && query.T_map_true
                            ? static_cast<double>(query.stamp_ns - first_ns) * 1e-9
                            : static_cast<double>(i));
      if (query.T_map_true) greatest = std::max(greatest, height_.back());
    }
    top_ = std::max(1.0, greatest);
    base_ = in_session_ ? 0.0 : -0.4 * top_;
  }

  /// In the frame of the charts.
  [[nodiscard]] Vector2d TruePosition(std::size_t query) const {
    return report_.queries[query].T_map_true->translation().head<2>() - origin_m_;
  }
  [[nodiscard]] Vector2d MatchedPosition(std::size_t query) const {
    return result_.matched_m[query] - origin_m_;
  }
  [[nodiscard]] Vector3d Lifted(std::size_t query) const {
    const Vector2d at_m = TruePosition(query);
    return {at_m.x(), at_m.y(), height_[query]};
  }
  /// Where the query's match is: in the map below, or on the path when it was mapped.
  [[nodiscard]] Vector3d Matched(std::size_t query) const {
    const Vector2d at_m = MatchedPosition(query);
    Vector3d matched(at_m.x(), at_m.y(), base_);
    if (!in_session_) return matched;
    // The place's own time is that of the scan which was taken there.
    double nearest_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < report_.queries.size(); ++i) {
      const eval::EvalQuery& older = report_.queries[i];
      if (!older.T_map_true || older.stamp_ns >= report_.queries[query].sees_until_ns) continue;
      const double distance_m = (TruePosition(i) - at_m).norm();
      if (distance_m >= nearest_m) continue;
      nearest_m = distance_m;
      matched.z() = height_[i];
    }
    return matched;
  }
  [[nodiscard]] ChartAxis Axis(char letter) const {
    const int i = letter == 'x' ? 0 : 1;
    return {absl::StrFormat("%c [m]", letter), extent_m_.min()[i], extent_m_.max()[i]};
  }
  /// Through places at these heights, thinned.
  [[nodiscard]] ChartSeries Path(const std::string& name, const std::vector<PicturedPlace>& places,
                                 const std::vector<double>& heights) const {
    ChartSeries path{.name = name, .points = {}};
    const std::size_t step = (places.size() + kMaxPathPoints - 1) / kMaxPathPoints;
    std::vector<std::size_t> starts = StretchStarts(places);
    starts.push_back(places.size());
    for (std::size_t k = 0; k + 1 < starts.size(); ++k) {
      if (k > 0) path.points.push_back(ChartSeries::kBreak);
      for (std::size_t i = starts[k]; i < starts[k + 1]; ++i) {
        if (i != starts[k] && i + 1 != starts[k + 1] && i % step != 0) continue;
        const Vector2d at_m = places[i].position - origin_m_;
        path.points.emplace_back(at_m.x(), at_m.y(), heights[i]);
      }
    }
    return path;
  }
  [[nodiscard]] ChartSeries MapPath() const {
    ChartSeries path = Path("map", report_.places, std::vector(report_.places.size(), base_));
    path.color = "#a0a0a0";
    path.width_px = 3.0;
    return path;
  }
  [[nodiscard]] ChartSeries QueryPath() const {
    std::vector<PicturedPlace> positions;
    std::vector<double> heights;
    for (std::size_t i = 0; i < report_.queries.size(); ++i) {
      if (!report_.queries[i].T_map_true) continue;
      positions.push_back({report_.queries[i].T_map_true->translation().head<2>(), 0});
      heights.push_back(height_[i]);
    }
    ChartSeries path = Path(in_session_ ? "drive" : "queries", positions, heights);
    path.color = colors::kBlack;
    path.width_px = 1.5;
    return path;
  }
  [[nodiscard]] std::vector<Vector3d> MarksAt(const std::vector<std::size_t>& queries) const {
    const double cell_m = kMarkShare * extent_m_.sizes().maxCoeff();
    std::set<std::pair<std::int64_t, std::int64_t>> taken;
    std::vector<Vector3d> marks;
    for (const std::size_t i : queries) {
      const Vector2d at_m = TruePosition(i);
      if (!taken.emplace(std::llround(at_m.x() / cell_m), std::llround(at_m.y() / cell_m)).second) {
        continue;
      }
      marks.emplace_back(at_m.x(), at_m.y(), 0.0);
    }
    return marks;
  }
  [[nodiscard]] std::string Note(const SortedQueries& sorted, bool has_missed) const {
    std::string note = absl::StrFormat("%d right, %d wrong", CountAll(sorted.right),
                                       sorted.wrong.size() + sorted.num_wrong_elsewhere);
    if (sorted.num_wrong_elsewhere > 0) {
      absl::StrAppend(&note, " (", sorted.num_wrong_elsewhere,
                      " of them for queries taken elsewhere, not drawn)");
    }
    if (has_missed) absl::StrAppend(&note, ", ", CountAll(sorted.missed), " revisits missed");
    note += ".";
    if (!origin_m_.isZero()) {
      absl::StrAppendFormat(&note, " Positions from (%.0f, %.0f) m of the map frame.",
                            origin_m_.x(), origin_m_.y());
    }
    return note;
  }

  const EvalReport& report_;
  const eval::MethodResult& result_;
  Eigen::AlignedBox2d extent_m_;          // of the charts
  Vector2d origin_m_ = Vector2d::Zero();  // of their frame, in the map's
  std::vector<double> height_;            // of each query: its time
  double base_ = 0.0;                     // height of the map
  double top_ = 1.0;
  std::string height_title_;
  bool in_session_ = false;
};

}  // namespace

std::vector<EvalFigure> DrawMatches(const EvalReport& report, const eval::MethodResult& result) {
  MatchCharts charts(report, result);
  return {
      charts.DrawTrajectory(),
      charts.DrawGraph(absl::StrCat("Matches of ", result.name, " over time, at its greatest F1"),
                       ThresholdAtF1Max(result)),
      charts.DrawGraph(absl::StrCat("Matches of ", result.name, " over time, at 100 % precision"),
                       ThresholdAtFullPrecision(result))};
}

}  // namespace scanloc::report
