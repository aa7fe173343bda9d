#include "scanloc/report/map_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "plan_axes.hpp"
#include "scanloc/eval/quantile.hpp"
#include "scanloc/report/chart.hpp"

namespace scanloc::report {
namespace {

using Eigen::Vector2d;
using Style = ChartSeries::Style;

constexpr double kMark_px = 9.0;
constexpr const char* kMapColor = "#a9b8c6";
constexpr const char* kWrongColor = colors::kVermilion;

Eigen::Vector3d OnFloor(const Vector2d& at) { return {at.x(), at.y(), 0.0}; }

ChartSeries MapPath(const std::vector<PicturedPlace>& places) {
  ChartSeries path{.name = absl::StrFormat("map: %d places", places.size()),
                   .color = kMapColor,
                   .width_px = 5.0,
                   .points = {}};
  const std::vector<std::size_t> starts = StretchStarts(places);
  auto next = starts.begin();
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (next != starts.end() && *next == i) {
      if (i > 0) path.points.push_back(ChartSeries::kBreak);
      ++next;
    }
    path.points.push_back(OnFloor(places[i].position));
  }
  return path;
}

/// The queries of one verdict: where they were answered, or those not recognised where they were.
ChartSeries MarksOf(const std::vector<PicturedQuery>& queries, Verdict verdict, const char* color,
                    const char* said) {
  ChartSeries marks{.style = Style::kMarks, .color = color, .mark_px = kMark_px, .points = {}};
  for (const PicturedQuery& query : queries) {
    if (query.verdict != verdict) continue;
    const auto& at = verdict == Verdict::kNotRecognized ? query.truth : query.answered;
    if (!at) continue;
    marks.points.push_back(OnFloor(*at));
    marks.tips.push_back(query.query + said);
  }
  return marks;
}

ChartSeries LinesToTruth(const std::vector<PicturedQuery>& queries) {
  ChartSeries lines{.style = Style::kSegments, .color = kWrongColor, .width_px = 1.0, .points = {}};
  for (const PicturedQuery& query : queries) {
    if (query.verdict != Verdict::kWrong || !query.answered || !query.truth) continue;
    lines.points.push_back(OnFloor(*query.answered));
    lines.points.push_back(OnFloor(*query.truth));
  }
  return lines;
}

}  // namespace

void SetPlanAxes(LineChart* chart) {
  constexpr double kSmallestSide_m = 20.0;
  Eigen::AlignedBox2d extent_m;
  for (const ChartSeries& series : chart->series) {
    for (const Eigen::Vector3d& point : series.points) {
      if (!point.hasNaN()) extent_m.extend(point.head<2>());
    }
  }
  if (extent_m.isEmpty()) extent_m.extend(Vector2d(0.0, 0.0));
  const Vector2d border_m =
      (Vector2d::Constant(kSmallestSide_m) - extent_m.sizes()).cwiseMax(0.0) / 2.0 +
      Vector2d::Constant(0.04 * std::max(extent_m.sizes().maxCoeff(), 1.0));
  chart->x = {"x in the map frame [m]", extent_m.min().x() - border_m.x(),
              extent_m.max().x() + border_m.x()};
  chart->y = {"y in the map frame [m]", extent_m.min().y() - border_m.y(),
              extent_m.max().y() + border_m.y()};
}

std::vector<std::size_t> StretchStarts(const std::vector<PicturedPlace>& places) {
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < places.size(); ++i) {
    steps_m.push_back((places[i].position - places[i - 1].position).norm());
  }
  const double jump_m = std::max(10.0, 5.0 * eval::Quantile(steps_m, 0.5).value_or(0.0));
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool goes_on =
        i > 0 && places[i].session == places[i - 1].session && steps_m[i - 1] <= jump_m;
    if (!goes_on) starts.push_back(i);
  }
  return starts;
}

std::string DrawMapPicture(const std::string& title, const std::vector<PicturedPlace>& places,
                           const std::vector<PicturedQuery>& queries) {
  const auto count = [&](Verdict verdict) {
    return std::ranges::count_if(
        queries, [&](const PicturedQuery& query) { return query.verdict == verdict; });
  };
  ChartSeries unknown =
      MarksOf(queries, Verdict::kNotRecognized, colors::kGrey, ": not recognised");
  unknown.mark = Mark::kOpenSquare;
  ChartSeries ambiguous = MarksOf(queries, Verdict::kAmbiguous, colors::kOrange, ": ambiguous");
  ambiguous.mark = Mark::kTriangle;
  ChartSeries right = MarksOf(queries, Verdict::kRight, colors::kBlue, ": right");
  ChartSeries unchecked = MarksOf(queries, Verdict::kUnchecked, colors::kSky, ": localized");
  unchecked.mark = Mark::kDiamond;
  ChartSeries wrong = MarksOf(queries, Verdict::kWrong, kWrongColor, ": wrong");
  wrong.mark = Mark::kCross;
  const auto num_unknown = count(Verdict::kNotRecognized);
  const auto num_ambiguous = count(Verdict::kAmbiguous);
  const bool all_drawn = unknown.points.size() == static_cast<std::size_t>(num_unknown);
  if (num_unknown > 0) {
    unknown.name = absl::StrFormat(
        "not recognised: %d%s", num_unknown,
        all_drawn ? " (at the true position)" : " (drawn where the truth is known)");
  }
  if (num_ambiguous > 0) {
    ambiguous.name = absl::StrFormat("ambiguous: %d (at the best guess)", num_ambiguous);
  }
  const auto num_right = count(Verdict::kRight);
  const auto num_wrong = count(Verdict::kWrong);
  const auto num_unchecked = count(Verdict::kUnchecked);
  if (num_right > 0 || num_wrong > 0) {
    right.name = absl::StrFormat("right: %d", num_right);
    wrong.name = absl::StrFormat("wrong: %d (line to the true position)", num_wrong);
  }
  if (num_unchecked > 0)
    unchecked.name = absl::StrFormat("localized, unchecked: %d", num_unchecked);
  LineChart chart{
      .series = {MapPath(places), std::move(unknown), std::move(ambiguous), std::move(right),
                 std::move(unchecked), LinesToTruth(queries), std::move(wrong)},
      .has_equal_scales = true,
      .title = title,
      .width_px = kPictureWidth_px};
  SetPlanAxes(&chart);
  return Draw(chart);
}

}  // namespace scanloc::report
