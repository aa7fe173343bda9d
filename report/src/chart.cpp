#include "scanloc/report/chart.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "absl/strings/str_format.h"
#include "chart_parts.hpp"
#include "svg.hpp"

namespace scanloc::report {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWidth_px = 460.0;
constexpr double kPlaneHeight_px = 320.0;
constexpr double kLeft_px = 76.0;
constexpr double kRight_px = 18.0;
constexpr double kTop_px = 10.0;
constexpr double kBottom_px = 46.0;
constexpr double kTitle_px = 24.0;
/// Cells are numbered if they are at most so many in a row.
constexpr std::size_t kMaxNumbered = 24;
constexpr const char* kBarColor = "#d9d9d9";

/// More is shown of one axis, so that both have one scale.
void EqualizeScales(Plane* plane) {
  const double px_per_unit = std::min(plane->size_px.x() / (plane->x.high - plane->x.low),
                                      plane->size_px.y() / (plane->y.high - plane->y.low));
  const auto widen = [&](ChartAxis* axis, double length_px) {
    const double middle = (axis->low + axis->high) / 2.0;
    axis->low = middle - length_px / px_per_unit / 2.0;
    axis->high = middle + length_px / px_per_unit / 2.0;
  };
  widen(&plane->x, plane->size_px.x());
  widen(&plane->y, plane->size_px.y());
}

void DrawAll(const Plane& plane, const std::vector<ChartSeries>& series, Svg* svg) {
  for (const ChartSeries& one : series) {
    DrawSeries(
        one, [&](const Vector3d& at) { return plane.Px(at.x(), at.y()); }, svg);
  }
}

/// From light to dark, at a share of the greatest.
std::string HeatColor(double share) {
  constexpr std::array<std::array<double, 3>, 3> kColors = {
      {{229, 239, 247}, {66, 146, 198}, {8, 48, 107}}};
  const double at = std::clamp(share, 0.0, 1.0) * 2.0;
  const std::size_t i = at < 1.0 ? 0 : 1;
  std::string color = "#";
  for (std::size_t k = 0; k < 3; ++k) {
    const double value =
        kColors[i][k] + (at - static_cast<double>(i)) * (kColors[i + 1][k] - kColors[i][k]);
    absl::StrAppendFormat(&color, "%02x", static_cast<int>(std::lround(value)));
  }
  return color;
}

void DrawSplits(const HeatMap& chart, const Plane& plane, Svg* svg) {
  std::string lines;
  if (chart.x_split < chart.x.high) {
    AppendMove(plane.Px(chart.x_split, chart.y.low), &lines);
    AppendLine(plane.Px(chart.x_split, chart.y.high), &lines);
  }
  if (chart.y_split < chart.y.high) {
    AppendMove(plane.Px(chart.x.low, chart.y_split), &lines);
    AppendLine(plane.Px(chart.x.high, chart.y_split), &lines);
  }
  if (!lines.empty()) svg->Path(lines, {.stroke = "#222222", .width_px = 1.5, .dashes = "6 4"});
}

void DrawColorBar(const HeatMap& chart, const Plane& plane, std::size_t greatest, Svg* svg) {
  constexpr int kNumSteps = 32;
  const double left_px = plane.corner_px.x() + plane.size_px.x() + 14.0;
  const double step_px = plane.size_px.y() / kNumSteps;
  for (int i = 0; i < kNumSteps; ++i) {
    svg->Rect({left_px, plane.corner_px.y() + (kNumSteps - 1 - i) * step_px}, {12.0, step_px + 0.5},
              HeatColor((i + 0.5) / kNumSteps));
  }
  const double bottom_px = plane.corner_px.y() + plane.size_px.y();
  svg->Text({left_px + 16.0, bottom_px}, "0", {.size_px = kTextSize_px});
  svg->Text({left_px + 16.0, plane.corner_px.y() + 10.0},
            TickText(static_cast<double>(std::max<std::size_t>(1, greatest))),
            {.size_px = kTextSize_px});
  svg->Text({left_px + 28.0, plane.corner_px.y() + plane.size_px.y() / 2.0}, chart.count_title,
            {.size_px = kTextSize_px, .anchor = "middle", .goes_up = true});
}

/// Lays space on the page: turned about z, seen from 30 degrees above the horizon.
class SpaceView {
 public:
  static constexpr double kSize_px = 440.0;

  explicit SpaceView(const SpaceChart& chart) : chart_(chart) {
    const double side = std::max(chart.x.high - chart.x.low, chart.y.high - chart.y.low);
    up_per_z_ = kHeightShare * side / (chart.z.high - chart.z.low);
    Eigen::AlignedBox2d seen;
    for (const double x : {chart.x.low, chart.x.high}) {
      for (const double y : {chart.y.low, chart.y.high}) {
        for (const double z : {chart.z.low, chart.z.high}) seen.extend(Flat({x, y, z}));
      }
    }
    // Numbers and titles are left of and below it.
    constexpr double kLabels_px = 50.0;
    const Vector2d room_px(kSize_px - 2.0 * kLabels_px, kSize_px - 1.5 * kLabels_px);
    px_per_unit_ = (room_px.array() / seen.sizes().array()).minCoeff();
    middle_ = seen.center();
  }

  [[nodiscard]] Vector2d Px(const Vector3d& at) const {
    const Vector2d from_middle = (Flat(at) - middle_) * px_per_unit_;
    return {kSize_px / 2.0 + from_middle.x(), kSize_px / 2.0 - 16.0 - from_middle.y()};
  }

 private:
  static constexpr double kTurn_rad = 35.0 * std::numbers::pi / 180.0;
  static constexpr double kHeightShare = 0.7;

  [[nodiscard]] Vector2d Flat(const Vector3d& at) const {
    const double depth = at.x() * std::sin(kTurn_rad) + at.y() * std::cos(kTurn_rad);
    const double up = (at.z() - chart_.z.low) * up_per_z_;
    return {at.x() * std::cos(kTurn_rad) - at.y() * std::sin(kTurn_rad),
            0.5 * depth + std::cos(std::numbers::pi / 6.0) * up};
  }

  const SpaceChart& chart_;
  double up_per_z_ = 1.0;
  double px_per_unit_ = 1.0;
  Vector2d middle_ = Vector2d::Zero();
};

/// A grid on the floor with its numbers in front, and the axis of z at the left.
void DrawSpaceAxes(const SpaceChart& chart, const ToPx& to_px, Svg* svg) {
  const ChartAxis& x = chart.x;
  const ChartAxis& y = chart.y;
  const double floor = chart.z.low;
  const double step = TickStep(std::max(x.high - x.low, y.high - y.low), 4.0);
  std::string grid;
  const auto line = [&](const Vector3d& from, const Vector3d& to) {
    AppendMove(to_px(from), &grid);
    AppendLine(to_px(to), &grid);
  };
  const auto label = [&](const Vector3d& at, const Vector2d& beside_px, const std::string& text,
                         std::string_view anchor) {
    svg->Text(to_px(at) + beside_px, text, {.size_px = kTextSize_px, .anchor = anchor});
  };
  for (const double at : Ticks(x.low, x.high, step)) {
    line({at, y.low, floor}, {at, y.high, floor});
    label({at, y.low, floor}, {4.0, 16.0}, TickText(at), "start");
  }
  for (const double at : Ticks(y.low, y.high, step)) {
    line({x.low, at, floor}, {x.high, at, floor});
    label({x.low, at, floor}, {-4.0, 16.0}, TickText(at), "end");
  }
  for (const double at :
       Ticks(chart.tick_from, chart.z.high, TickStep(chart.z.high - chart.tick_from, 4.0))) {
    line({x.low, y.high, at}, {x.high, y.high, at});
    label({x.low, y.high, at}, {-6.0, 4.5}, TickText(at), "end");
  }
  svg->Path(grid, {.stroke = "#dddddd"});
  grid.clear();
  line({x.low, y.high, floor}, {x.low, y.low, floor});
  line({x.low, y.low, floor}, {x.high, y.low, floor});
  line({x.low, y.high, floor}, {x.low, y.high, chart.z.high});
  svg->Path(grid, {.stroke = "#666666"});
  label({(x.low + x.high) / 2.0, y.low, floor}, {24.0, 34.0}, x.title, "start");
  label({x.low, (y.low + y.high) / 2.0, floor}, {-24.0, 34.0}, y.title, "end");
  const Vector2d middle_px = to_px({x.low, y.high, (floor + chart.z.high) / 2.0});
  svg->Text({16.0, middle_px.y()}, chart.z.title,
            {.size_px = kTextSize_px, .anchor = "middle", .goes_up = true});
}

}  // namespace

void SetLook(std::string_view method, ChartSeries* series) {
  struct Family {
    std::string_view name;
    const char* color;
    Mark mark;
  };
  // Longer names before those that they begin with.
  constexpr std::array<Family, 7> kFamilies = {{{"a-pc", colors::kVermilion, Mark::kTriangle},
                                                {"a-cc", colors::kGreen, Mark::kSquare},
                                                {"auto", colors::kBlue, Mark::kDisc},
                                                {"m2dp", colors::kSky, Mark::kDiamond},
                                                {"segmatch", colors::kGrey, Mark::kOpenDiamond},
                                                {"pc", colors::kOrange, Mark::kOpenTriangle},
                                                {"cc", colors::kPurple, Mark::kOpenSquare}}};
  const auto* const family = std::ranges::find_if(
      kFamilies, [&](const Family& f) { return method.substr(0, f.name.size()) == f.name; });
  const bool is_known = family != kFamilies.end();
  series->color = is_known ? family->color : colors::kBlack;
  series->mark = is_known ? family->mark : Mark::kRing;
  const std::string_view how = method.substr(is_known ? family->name.size() : 0);
  constexpr std::array<std::string_view, 10> kVariants = {
      "-key",       "-trees", "-mean",  "-count", "-bits",
      "-intensity", "-radar", "-naive", "-brute", "-naive-brute"};
  const std::string_view variant = how.substr(0, how.find(':'));
  const auto* const known = std::ranges::find(kVariants, variant);
  series->dash =
      variant.empty() ? (how.empty() ? 1 : 2) : 3 + static_cast<int>(known - kVariants.begin());
}

std::string Draw(const LineChart& chart) {
  const double plane_width_px = chart.width_px - kLeft_px - kRight_px;
  const Legend legend(chart.series, plane_width_px);
  const double title_px = chart.title.empty() ? 0.0 : kTitle_px;
  Plane plane{.corner_px = {kLeft_px, kTop_px + title_px + legend.height_px()},
              .size_px = {plane_width_px, kPlaneHeight_px},
              .x = chart.x,
              .y = chart.y};
  if (chart.has_equal_scales) {
    const double aspect = (chart.y.high - chart.y.low) / (chart.x.high - chart.x.low);
    plane.size_px.y() = std::clamp(aspect, 0.3, 1.0) * plane_width_px;
    EqualizeScales(&plane);
  }
  Svg svg({chart.width_px, plane.corner_px.y() + plane.size_px.y() + kBottom_px});
  if (!chart.title.empty()) {
    svg.Text({kLeft_px, kTop_px + 16.0}, chart.title, {.size_px = 18.0, .is_bold = true});
  }
  legend.DrawAt({kLeft_px, kTop_px + title_px}, &svg);
  DrawAxes(plane, &svg);
  DrawAll(plane, chart.series, &svg);
  return svg.Finish();
}

std::string Draw(const SpaceChart& chart) {
  const SpaceView view(chart);
  const Legend legend(chart.series, kWidth_px - 2.0 * kTop_px);
  Svg svg({kWidth_px, legend.height_px() + SpaceView::kSize_px});
  legend.DrawAt({kTop_px, kTop_px}, &svg);
  const ToPx to_px = [&](const Vector3d& at) -> Vector2d {
    return view.Px(at) + Vector2d(0.0, legend.height_px());
  };
  DrawSpaceAxes(chart, to_px, &svg);
  for (const ChartSeries& series : chart.series) DrawSeries(series, to_px, &svg);
  return svg.Finish();
}

std::string Draw(const HeatMap& chart) {
  constexpr double kBarRoom_px = 44.0;
  const Plane plane{.corner_px = {kLeft_px, kTop_px},
                    .size_px = {kWidth_px - kLeft_px - kRight_px - kBarRoom_px, kPlaneHeight_px},
                    .x = chart.x,
                    .y = chart.y};
  Svg svg({kWidth_px, kTop_px + kPlaneHeight_px + kBottom_px});
  DrawAxes(plane, &svg);
  std::size_t greatest = 0;
  for (const auto& row : chart.cells) {
    for (const std::size_t count : row) greatest = std::max(greatest, count);
  }
  for (std::size_t row = 0; row < chart.cells.size(); ++row) {
    const std::size_t num_columns = chart.cells[row].size();
    const Vector2d cell_px(plane.size_px.x() / static_cast<double>(num_columns),
                           plane.size_px.y() / static_cast<double>(chart.cells.size()));
    for (std::size_t column = 0; column < num_columns; ++column) {
      const std::size_t count = chart.cells[row][column];
      if (count == 0) continue;
      const double share = static_cast<double>(count) / static_cast<double>(greatest);
      const Vector2d corner_px =
          plane.corner_px +
          Vector2d(static_cast<double>(column) * cell_px.x(),
                   static_cast<double>(chart.cells.size() - 1 - row) * cell_px.y());
      svg.Rect(corner_px, cell_px, HeatColor(share));
      if (num_columns > kMaxNumbered) continue;
      svg.Text(corner_px + cell_px / 2.0 + Vector2d(0.0, 4.0), absl::StrFormat("%d", count),
               {.size_px = 11.0, .anchor = "middle", .fill = share > 0.5 ? "#ffffff" : "#000000"});
    }
  }
  DrawSplits(chart, plane, &svg);
  DrawColorBar(chart, plane, greatest, &svg);
  return svg.Finish();
}

std::string Draw(const BarChart& chart) {
  constexpr double kCountRoom_px = 40.0;
  // In the legend, too.
  std::vector<ChartSeries> named = {
      {.name = chart.count_title, .color = kBarColor, .width_px = 9.0, .points = {}}};
  named.insert(named.end(), chart.series.begin(), chart.series.end());
  const Legend legend(named, kWidth_px - kLeft_px - kRight_px);
  Plane plane{.corner_px = {kLeft_px, kTop_px + legend.height_px()},
              .size_px = {kWidth_px - kLeft_px - kRight_px - kCountRoom_px, kPlaneHeight_px},
              .x = chart.x,
              .y = chart.y};
  Svg svg({kWidth_px, plane.corner_px.y() + kPlaneHeight_px + kBottom_px});
  legend.DrawAt({kLeft_px, kTop_px}, &svg);
  std::size_t greatest = 1;
  for (const BarChart::Bar& bar : chart.bars) greatest = std::max(greatest, bar.count);
  // Room for the number above the highest bar.
  Plane counts = plane;
  counts.y = {chart.count_title, 0.0, 1.15 * static_cast<double>(greatest)};
  for (const BarChart::Bar& bar : chart.bars) {
    const double gap = 0.05 * (bar.high - bar.low);
    const Vector2d top_px = counts.Px(bar.low + gap, static_cast<double>(bar.count));
    const Vector2d bottom_px = counts.Px(bar.high - gap, 0.0);
    svg.Rect(top_px, bottom_px - top_px, kBarColor);
    svg.Text({(top_px.x() + bottom_px.x()) / 2.0, top_px.y() - 4.0},
             absl::StrFormat("%d", bar.count),
             {.size_px = 12.0, .anchor = "middle", .fill = "#555555"});
  }
  DrawAxes(plane, &svg);
  const double right_px = plane.corner_px.x() + plane.size_px.x();
  for (const double count :
       Ticks(0.0, counts.y.high, std::max(1.0, TickStep(counts.y.high, 5.0)))) {
    svg.Text({right_px + 6.0, counts.Px(0.0, count).y() + 4.5}, TickText(count),
             {.size_px = kTextSize_px});
  }
  DrawAll(plane, chart.series, &svg);
  return svg.Finish();
}

}  // namespace scanloc::report
