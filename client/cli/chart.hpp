#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace scanloc::cli {

/// One line of a chart.
struct ChartLine {
  std::string name;
  std::vector<Eigen::Vector2d> points;
  bool has_dots = false;  ///< a dot at every point
};

struct ChartAxis {
  std::string title;  ///< with unit
  double low = 0.0;
  double high = 1.0;
};

/// A line chart with axes, grid and legend as one SVG document; values beyond the axes are drawn at
/// their ends.
[[nodiscard]] std::string DrawChart(const std::string& title, const ChartAxis& x,
                                    const ChartAxis& y, const std::vector<ChartLine>& lines);

/// Cells of counts as shades, the row of index 0 at the bottom: `cells[row][column]`.
[[nodiscard]] std::string DrawHeatMap(const std::string& title, const ChartAxis& x,
                                      const ChartAxis& y,
                                      const std::vector<std::vector<double>>& cells);

}  // namespace scanloc::cli
