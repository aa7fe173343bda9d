#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace scanloc::report {

/// Of Okabe and Ito: told apart by colour-blind people, too.
namespace colors {
inline constexpr const char* kBlue = "#0072b2";
inline constexpr const char* kVermilion = "#d55e00";
inline constexpr const char* kGreen = "#009e73";
inline constexpr const char* kPurple = "#cc79a7";
inline constexpr const char* kOrange = "#e69f00";
inline constexpr const char* kSky = "#56b4e9";
inline constexpr const char* kBlack = "#000000";
inline constexpr const char* kGrey = "#888888";
}  // namespace colors

/// Signs for points.
enum class Mark {
  kDisc,
  kRing,
  kTriangle,
  kOpenTriangle,
  kSquare,
  kOpenSquare,
  kDiamond,
  kOpenDiamond,
  kCross
};

struct ChartAxis {
  std::string title;  ///< with unit
  double low = 0.0;
  double high = 1.0;
};

inline constexpr int kNumDashes = 13;

/// What is drawn alike and has one entry in the legend. Charts of two axes leave z out.
struct ChartSeries {
  enum class Style { kPath, kMarks, kSegments };

  std::string name;  ///< empty: not in the legend
  Style style = Style::kPath;
  std::string color = colors::kBlack;
  int dash = 1;  ///< 1: none; 2 to kNumDashes: patterns
  double width_px = 2.0;
  Mark mark = Mark::kDisc;
  double mark_px = 6.0;  ///< across
  /// Of segments: begin, end, begin, end. A path is interrupted at kBreak.
  std::vector<Eigen::Vector3d> points;
  /// What each mark tells when the pointer rests on it; empty: nothing.
  std::vector<std::string> tips = {};

  inline static const Eigen::Vector3d kBreak =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// The look of a method, the same in every chart: a colour and a mark for what it compares
/// ("a-pc"), a dash for how ("a-pc-key", "a-pc:10"); black for descriptors computed elsewhere.
void SetLook(std::string_view method, ChartSeries* series);

struct LineChart {
  ChartAxis x, y;
  std::vector<ChartSeries> series;
  bool has_equal_scales = false;  ///< of x and y: more may be shown of one of them
  std::string title = {};         ///< above the chart
  double width_px = 460.0;
};

/// Seen from above at an angle, z up; x and y have equal scales.
struct SpaceChart {
  ChartAxis x, y, z;
  double tick_from = 0.0;  ///< least number at the z axis
  std::vector<ChartSeries> series;
};

/// Counts in cells, `cells[row][column]`, the row of index 0 at the bottom, with a colour bar and
/// the numbers.
struct HeatMap {
  ChartAxis x, y;
  std::string count_title;
  std::vector<std::vector<std::size_t>> cells;
  double x_split = 0.0, y_split = 0.0;  ///< dashed lines here
};

/// A line of dots, and bars behind it that count, with their numbers, on an axis of their own.
struct BarChart {
  struct Bar {
    double low = 0.0, high = 0.0;
    std::size_t count = 0;
  };
  ChartAxis x, y;
  std::string count_title;
  std::vector<Bar> bars;
  std::vector<ChartSeries> series;
};

/// Each draws an `<svg>` element that needs nothing else: a page may hold several, a file one.
/// Points must be finite, ranges not empty.
[[nodiscard]] std::string Draw(const LineChart& chart);
[[nodiscard]] std::string Draw(const SpaceChart& chart);
[[nodiscard]] std::string Draw(const HeatMap& chart);
[[nodiscard]] std::string Draw(const BarChart& chart);

/// What each shows, a row a point or a cell, under the titles of the axes: series with a name, as
/// far as they are drawn.
[[nodiscard]] std::string AsCsv(const LineChart& chart);
[[nodiscard]] std::string AsCsv(const SpaceChart& chart);
[[nodiscard]] std::string AsCsv(const HeatMap& chart);
[[nodiscard]] std::string AsCsv(const BarChart& chart);

}  // namespace scanloc::report
