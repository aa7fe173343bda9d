#include "chart_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace scanloc::report {
namespace {

using Eigen::Vector2d;
using Style = ChartSeries::Style;

constexpr const char* kGridColor = "#dddddd";
constexpr const char* kFrameColor = "#666666";
constexpr double kLegendRow_px = 19.0;
constexpr double kSign_px = 26.0;
/// Of letters, on the average, by their height.
constexpr double kLetterShare = 0.55;

const char* Dashes(int dash) {
  constexpr std::array<const char*, kNumDashes> kDashes = {
      "",        "8 4",      "3 3",     "8 3 2 3",          "12 4 2 4 2 4", "14 4", "2 5",
      "6 2 1 2", "16 3 5 3", "5 2 5 6", "10 2 2 2 2 2 2 2", "14 3 3 3 6 3", "1 3"};
  return kDashes[static_cast<std::size_t>(std::clamp(dash, 1, kNumDashes) - 1)];
}

/// Names that are too long for a legend are cut, between letters.
std::string LegendText(const std::string& name) {
  constexpr std::size_t kMaxBytes = 48;
  if (name.size() <= kMaxBytes) return name;
  std::size_t end = kMaxBytes - 3;
  const auto goes_on = [&] { return (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80; };
  while (end > 0 && goes_on()) --end;
  return name.substr(0, end) + "...";
}

/// From its middle.
std::string MarkPath(Mark mark, double across_px) {
  const double r = across_px / 2.0;
  switch (mark) {
    case Mark::kDisc:
    case Mark::kRing:
      return absl::StrFormat("m%g 0a%g %g 0 1 0 %g 0a%g %g 0 1 0 %g 0z", -r, r, r, 2 * r, r, r,
                             -2 * r);
    case Mark::kTriangle:
    case Mark::kOpenTriangle:
      return absl::StrFormat("m%g %gh%gl%g %gz", -r, 0.8 * r, 2 * r, -r, -1.7 * r);
    case Mark::kSquare:
    case Mark::kOpenSquare:
      return absl::StrFormat("m%g %gh%gv%gh%gz", -r, -r, 2 * r, 2 * r, -2 * r);
    case Mark::kDiamond:
    case Mark::kOpenDiamond:
      return absl::StrFormat("m0 %gl%g %gl%g %gl%g %gz", -1.2 * r, r, 1.2 * r, -r, 1.2 * r, -r,
                             -1.2 * r);
    case Mark::kCross:
      return absl::StrFormat("m%g %gl%g %gm%g 0l%g %g", -r, -r, 2 * r, 2 * r, -2 * r, 2 * r,
                             -2 * r);
  }
  return "";
}

bool IsOpen(Mark mark) {
  return mark == Mark::kRing || mark == Mark::kOpenTriangle || mark == Mark::kOpenSquare ||
         mark == Mark::kOpenDiamond || mark == Mark::kCross;
}

Svg::Look LookOf(const ChartSeries& series) {
  if (series.style != Style::kMarks) {
    return {.stroke = series.color, .width_px = series.width_px, .dashes = Dashes(series.dash)};
  }
  if (IsOpen(series.mark)) return {.stroke = series.color, .width_px = series.width_px};
  return {.fill = series.color};
}

}  // namespace

double TickStep(double length, double max_steps) {
  const double rough = length / max_steps;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= rough) return step * power;
  }
  return 10.0 * power;
}

std::vector<double> Ticks(double low, double high, double step) {
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9);
  for (double i = first; i * step <= high + 1e-9 * step; i += 1.0) {
    ticks.push_back(i * step + 0.0);
  }
  return ticks;
}

std::string TickText(double value) { return absl::StrFormat("%.10g", value); }

void DrawAxes(const Plane& plane, Svg* svg) {
  constexpr double kRoom_px = 60.0;
  const auto step = [&](const ChartAxis& axis, double length_px) {
    return TickStep(axis.high - axis.low, std::max(2.0, length_px / kRoom_px));
  };
  const double bottom_px = plane.corner_px.y() + plane.size_px.y();
  std::string grid;
  for (const double x : Ticks(plane.x.low, plane.x.high, step(plane.x, plane.size_px.x()))) {
    const double x_px = plane.Px(x, plane.y.low).x();
    AppendMove({x_px, bottom_px}, &grid);
    AppendLine({x_px, plane.corner_px.y()}, &grid);
    svg->Text({x_px, bottom_px + 17.0}, TickText(x), {.size_px = kTextSize_px, .anchor = "middle"});
  }
  for (const double y : Ticks(plane.y.low, plane.y.high, step(plane.y, plane.size_px.y()))) {
    const double y_px = plane.Px(plane.x.low, y).y();
    AppendMove({plane.corner_px.x(), y_px}, &grid);
    AppendLine({plane.corner_px.x() + plane.size_px.x(), y_px}, &grid);
    svg->Text({plane.corner_px.x() - 6.0, y_px + 4.5}, TickText(y),
              {.size_px = kTextSize_px, .anchor = "end"});
  }
  svg->Path(grid, {.stroke = kGridColor});
  std::string frame;
  AppendMove(plane.corner_px, &frame);
  absl::StrAppend(&frame, "v", ShortNumber(plane.size_px.y()), "h", ShortNumber(plane.size_px.x()));
  svg->Path(frame, {.stroke = kFrameColor});
  svg->Text({plane.corner_px.x() + plane.size_px.x() / 2.0, bottom_px + 36.0}, plane.x.title,
            {.size_px = kTextSize_px, .anchor = "middle"});
  svg->Text({16.0, plane.corner_px.y() + plane.size_px.y() / 2.0}, plane.y.title,
            {.size_px = kTextSize_px, .anchor = "middle", .goes_up = true});
}

Legend::Legend(const std::vector<ChartSeries>& series, double width_px) {
  Vector2d at_px(0.0, kLegendRow_px / 2.0);
  for (const ChartSeries& one : series) {
    if (one.name.empty()) continue;
    std::string text = LegendText(one.name);
    const double entry_px =
        kSign_px + kLetterShare * kTextSize_px * static_cast<double>(text.size()) + 18.0;
    if (at_px.x() > 0.0 && at_px.x() + entry_px > width_px) {
      at_px = {0.0, at_px.y() + kLegendRow_px};
    }
    entries_.push_back({&one, std::move(text), at_px});
    at_px.x() += entry_px;
  }
  if (!entries_.empty()) height_px_ = at_px.y() + kLegendRow_px;
}

void Legend::DrawAt(const Vector2d& corner_px, Svg* svg) const {
  for (const Entry& entry : entries_) {
    const Vector2d at_px = corner_px + entry.at_px;
    std::string sign;
    if (entry.series->style == Style::kMarks) {
      AppendMove(at_px + Vector2d(kSign_px / 2.0 - 3.0, 0.0), &sign);
      sign += MarkPath(entry.series->mark, entry.series->mark_px);
    } else {
      AppendMove(at_px, &sign);
      AppendLine(at_px + Vector2d(kSign_px - 6.0, 0.0), &sign);
    }
    svg->Path(sign, LookOf(*entry.series));
    svg->Text(at_px + Vector2d(kSign_px, 4.5), entry.text, {.size_px = kTextSize_px});
  }
}

void DrawSeries(const ChartSeries& series, const ToPx& to_px, Svg* svg) {
  Svg::Look look = LookOf(series);
  std::string path;
  bool begins = true;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    if (series.points[i].hasNaN()) {
      begins = true;
      continue;
    }
    const Vector2d at_px = to_px(series.points[i]);
    if (series.style == Style::kMarks || begins ||
        (series.style == Style::kSegments && i % 2 == 0)) {
      AppendMove(at_px, &path);
      // A path of one point is a dot.
      if (series.style == Style::kPath) path += "h0";
    } else {
      AppendLine(at_px, &path);
    }
    begins = false;
    if (series.style != Style::kMarks) continue;
    path += MarkPath(series.mark, series.mark_px);
    if (i >= series.tips.size()) continue;
    look.tip = series.tips[i];
    svg->Path(path, look);
    path.clear();
  }
  if (!path.empty()) svg->Path(path, look);
}

}  // namespace scanloc::report
