#include "cli/chart.hpp"

#include <algorithm>
#include <array>

#include "absl/strings/str_format.h"
#include "cli/svg.hpp"

namespace scanloc::cli {
namespace {

using Eigen::Vector2d;

constexpr double kWidth_px = 560.0;
constexpr double kHeight_px = 380.0;
constexpr double kLeft_px = 64.0;
constexpr double kRight_px = 16.0;
constexpr double kTop_px = 36.0;
constexpr double kBottom_px = 52.0;
constexpr double kTextSize_px = 12.0;
/// Of a letter of the legend, about.
constexpr double kLetter_px = 6.6;
constexpr double kLegendRow_px = 18.0;
constexpr int kNumTicks = 5;
constexpr const char* kGridColor = "#dddddd";
// Of Okabe and Ito: told apart by colour-blind people, too.
constexpr std::array<const char*, 8> kColors = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                "#e69f00", "#56b4e9", "#000000", "#888888"};

class Frame {
 public:
  Frame(const ChartAxis& x, const ChartAxis& y) : x_(x), y_(y) {}

  [[nodiscard]] Vector2d Px(const Vector2d& value) const {
    const auto share = [](double v, const ChartAxis& axis) {
      return std::clamp((v - axis.low) / (axis.high - axis.low), 0.0, 1.0);
    };
    return {kLeft_px + share(value.x(), x_) * (kWidth_px - kLeft_px - kRight_px),
            kHeight_px - kBottom_px - share(value.y(), y_) * (kHeight_px - kTop_px - kBottom_px)};
  }

  void Draw(const std::string& title, Svg* svg) const {
    svg->Rect({0.0, 0.0}, {kWidth_px, kHeight_px}, "white");
    svg->Text({kWidth_px / 2.0, 22.0}, title, 15.0, Svg::Anchor::kMiddle, true);
    for (int i = 0; i <= kNumTicks; ++i) {
      const double share = static_cast<double>(i) / kNumTicks;
      const double x = x_.low + share * (x_.high - x_.low);
      const double y = y_.low + share * (y_.high - y_.low);
      svg->Line(Px({x, y_.low}), Px({x, y_.high}), kGridColor, 1.0);
      svg->Line(Px({x_.low, y}), Px({x_.high, y}), kGridColor, 1.0);
      svg->Text(Px({x, y_.low}) + Vector2d(0.0, 18.0), absl::StrFormat("%.3g", x), kTextSize_px,
                Svg::Anchor::kMiddle);
      svg->Text(Px({x_.low, y}) + Vector2d(-8.0, 4.0), absl::StrFormat("%.3g", y), kTextSize_px,
                Svg::Anchor::kEnd);
    }
    svg->Text({(kLeft_px + kWidth_px - kRight_px) / 2.0, kHeight_px - 14.0}, x_.title, 13.0,
              Svg::Anchor::kMiddle);
    svg->UpwardText({18.0, (kTop_px + kHeight_px - kBottom_px) / 2.0}, y_.title, 13.0);
  }

 private:
  const ChartAxis& x_;
  const ChartAxis& y_;
};

}  // namespace

std::string DrawChart(const std::string& title, const ChartAxis& x, const ChartAxis& y,
                      const std::vector<ChartLine>& lines) {
  std::size_t longest = 0;
  for (const ChartLine& line : lines) longest = std::max(longest, line.name.size());
  // Beside the axes, where it hides no line.
  const double legend_px = kWidth_px + 4.0;
  Svg svg(legend_px + 44.0 + kLetter_px * static_cast<double>(longest), kHeight_px);
  const Frame frame(x, y);
  frame.Draw(title, &svg);
  const auto color_of = [](std::size_t i) { return kColors[i % kColors.size()]; };
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const char* color = color_of(i);
    std::vector<Vector2d> points_px;
    for (const Vector2d& point : lines[i].points) points_px.push_back(frame.Px(point));
    if (points_px.size() > 1) svg.Polyline(points_px, color, 2.0);
    if (lines[i].has_dots || points_px.size() == 1) {
      for (const Vector2d& point : points_px) svg.Circle(point, 3.5, color);
    }
    const double y_px = kTop_px + 8.0 + kLegendRow_px * static_cast<double>(i);
    svg.Line({legend_px, y_px}, {legend_px + 24.0, y_px}, color, 2.0);
    svg.Text({legend_px + 30.0, y_px + 4.0}, lines[i].name, kTextSize_px);
  }
  return svg.Finish();
}

std::string DrawHeatMap(const std::string& title, const ChartAxis& x, const ChartAxis& y,
                        const std::vector<std::vector<double>>& cells) {
  Svg svg(kWidth_px, kHeight_px);
  const Frame frame(x, y);
  frame.Draw(title, &svg);
  double greatest = 0.0;
  for (const std::vector<double>& row : cells) {
    for (const double cell : row) greatest = std::max(greatest, cell);
  }
  for (std::size_t row = 0; row < cells.size() && greatest > 0.0; ++row) {
    const auto num_rows = static_cast<double>(cells.size());
    const auto num_columns = static_cast<double>(cells[row].size());
    for (std::size_t column = 0; column < cells[row].size(); ++column) {
      if (cells[row][column] <= 0.0) continue;
      const auto at = [&](double c, double r) {
        return frame.Px(
            {x.low + (x.high - x.low) * c / num_columns, y.low + (y.high - y.low) * r / num_rows});
      };
      const auto c = static_cast<double>(column);
      const auto r = static_cast<double>(row);
      const Vector2d corner = at(c, r + 1.0);
      const double share = cells[row][column] / greatest;
      const int light = static_cast<int>(225.0 * (1.0 - share));
      svg.Rect(corner, at(c + 1.0, r) - corner, absl::StrFormat("rgb(%d,%d,255)", light, light));
    }
  }
  return svg.Finish();
}

}  // namespace scanloc::cli
