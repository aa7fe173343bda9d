#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "scanloc/report/chart.hpp"
#include "svg.hpp"

/// What the charts are put together of.
namespace scanloc::report {

inline constexpr double kTextSize_px = 13.0;

/// The part of a drawing where points are drawn, and what it shows.
struct Plane {
  Eigen::Vector2d corner_px;  ///< upper left
  Eigen::Vector2d size_px;
  ChartAxis x, y;

  [[nodiscard]] Eigen::Vector2d Px(double at_x, double at_y) const {
    return corner_px + Eigen::Vector2d((at_x - x.low) / (x.high - x.low) * size_px.x(),
                                       (y.high - at_y) / (y.high - y.low) * size_px.y());
  }
};

/// 1, 2 or 5 times a power of ten: the least that makes at most so many steps.
[[nodiscard]] double TickStep(double length, double max_steps);
/// The multiples of the step within a range.
[[nodiscard]] std::vector<double> Ticks(double low, double high, double step);
[[nodiscard]] std::string TickText(double value);

/// Grid, frame, numbers and titles of both axes.
void DrawAxes(const Plane& plane, Svg* svg);

/// One entry a series with a name; from left to right, in rows.
class Legend {
 public:
  Legend(const std::vector<ChartSeries>& series, double width_px);
  [[nodiscard]] double height_px() const { return height_px_; }
  void DrawAt(const Eigen::Vector2d& corner_px, Svg* svg) const;

 private:
  struct Entry {
    const ChartSeries* series;
    std::string text;
    Eigen::Vector2d at_px;
  };
  std::vector<Entry> entries_;
  double height_px_ = 0.0;
};

using ToPx = std::function<Eigen::Vector2d(const Eigen::Vector3d&)>;
void DrawSeries(const ChartSeries& series, const ToPx& to_px, Svg* svg);

}  // namespace scanloc::report
