#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::cli {

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

/// Signs for points, by gnuplot's numbers.
enum class Mark {
  kDisc = 7,
  kRing = 6,
  kTriangle = 9,
  kOpenTriangle = 8,
  kSquare = 5,
  kOpenSquare = 4,
  kDiamond = 13,
  kOpenDiamond = 12,
  kCross = 2
};

struct ChartAxis {
  std::string title;  ///< with unit
  double low = 0.0;
  double high = 1.0;
};

/// What is drawn alike and has one entry in the legend. Charts of two axes leave z out.
struct ChartSeries {
  enum class Style { kPath, kMarks, kSegments };

  std::string name;  ///< empty: not in the legend
  Style style = Style::kPath;
  std::string color = colors::kBlack;
  int dash = 1;  ///< 1: none; 2 to 5: patterns
  double width = 2.0;
  Mark mark = Mark::kDisc;
  double mark_size = 0.5;
  /// Of segments: begin, end, begin, end. A path is interrupted at kBreak.
  std::vector<Eigen::Vector3d> points;

  inline static const Eigen::Vector3d kBreak =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// The look of the i-th of several lines: colours first, then dashes, too.
void SetLook(std::size_t i, ChartSeries* series);

struct LineChart {
  ChartAxis x, y;
  std::vector<ChartSeries> series;
  bool has_equal_scales = false;  ///< of x and y
};

/// Seen from above at an angle, z up.
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

/// Charts to be drawn by one run of gnuplot.
class ChartSheet {
 public:
  /// Each returns the number of the drawing. Points must be finite, ranges not empty.
  std::size_t Add(const LineChart& chart);
  std::size_t Add(const SpaceChart& chart);
  std::size_t Add(const HeatMap& chart);
  std::size_t Add(const BarChart& chart);

  struct Drawings {
    /// SVG elements that need nothing else; no id is in two of them.
    std::vector<std::string> svgs;
    std::string warnings;  ///< of gnuplot; empty if all is well
  };
  /// Errors as of RunGnuplot.
  [[nodiscard]] absl::StatusOr<Drawings> Draw() const;

 private:
  std::size_t Begin(double width_px, double height_px);
  void SetAxis(const char* letter, const ChartAxis& axis);
  /// Appends the data and returns its name.
  std::string AddData(const ChartSeries& series);
  void Plot(const char* command, std::vector<std::string> parts);

  std::string script_;
  std::size_t num_charts_ = 0;
  std::size_t num_data_ = 0;
};

}  // namespace scanloc::cli
