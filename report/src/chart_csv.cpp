// What charts show, as CSV.
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/report/chart.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::report {
namespace {

std::string NumberText(double value) { return absl::StrFormat("%.10g", value); }

// A row a point: the stretch of a path, the segment, or 0 for marks; what repeats a series with a
// name has none and is left out.
void AppendSeries(const std::vector<ChartSeries>& all, int num_axes, std::string* csv) {
  for (const ChartSeries& series : all) {
    if (series.name.empty()) continue;
    std::size_t part = 0;
    for (std::size_t i = 0; i < series.points.size(); ++i) {
      const Eigen::Vector3d& point = series.points[i];
      if (std::isnan(point.x())) {
        ++part;
        continue;
      }
      if (series.style == ChartSeries::Style::kSegments) part = i / 2;
      std::vector<std::string> row = {series.name, absl::StrCat(part)};
      for (int axis = 0; axis < num_axes; ++axis) row.push_back(NumberText(point[axis]));
      *csv += CsvRow(row);
    }
  }
}

}  // namespace

std::string AsCsv(const LineChart& chart) {
  std::string csv = CsvRow({"series", "part", chart.x.title, chart.y.title});
  AppendSeries(chart.series, 2, &csv);
  return csv;
}

std::string AsCsv(const SpaceChart& chart) {
  std::string csv = CsvRow({"series", "part", chart.x.title, chart.y.title, chart.z.title});
  AppendSeries(chart.series, 3, &csv);
  return csv;
}

std::string AsCsv(const HeatMap& chart) {
  std::string csv =
      CsvRow({absl::StrCat(chart.x.title, ", from"), absl::StrCat(chart.x.title, ", to"),
              absl::StrCat(chart.y.title, ", from"), absl::StrCat(chart.y.title, ", to"),
              chart.count_title});
  const auto edge = [](const ChartAxis& axis, std::size_t i, std::size_t num) {
    const double share = static_cast<double>(i) / static_cast<double>(num);
    return NumberText(axis.low + share * (axis.high - axis.low));
  };
  for (std::size_t row = 0; row < chart.cells.size(); ++row) {
    const std::vector<std::size_t>& cells = chart.cells[row];
    for (std::size_t column = 0; column < cells.size(); ++column) {
      csv += CsvRow({edge(chart.x, column, cells.size()), edge(chart.x, column + 1, cells.size()),
                     edge(chart.y, row, chart.cells.size()),
                     edge(chart.y, row + 1, chart.cells.size()), absl::StrCat(cells[column])});
    }
  }
  return csv;
}

std::string AsCsv(const BarChart& chart) {
  std::string csv = CsvRow({"series", "part", chart.x.title, chart.y.title});
  AppendSeries(chart.series, 2, &csv);
  for (std::size_t i = 0; i < chart.bars.size(); ++i) {
    const BarChart::Bar& bar = chart.bars[i];
    csv += CsvRow({chart.count_title, absl::StrCat(i), NumberText((bar.low + bar.high) / 2.0),
                   absl::StrCat(bar.count)});
  }
  return csv;
}

}  // namespace scanloc::report
