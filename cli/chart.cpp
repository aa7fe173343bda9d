#include "cli/chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "cli/gnuplot.hpp"

namespace scanloc::cli {
namespace {

using Style = ChartSeries::Style;

constexpr double kWidth_px = 460.0;
constexpr double kHeight_px = 400.0;
/// Of charts with equal scales: what is left and right of the axes, and above and below.
constexpr double kBeside_px = 80.0;
constexpr double kAbove_px = 90.0;
constexpr double kLegendRow_px = 19.0;
/// Cells are numbered if they are at most so many in a row.
constexpr std::size_t kMaxNumbered = 24;
/// Of the greatest count: numbers on darker cells are white.
constexpr double kDarkShare = 0.5;

std::string ChartName(std::size_t number) { return absl::StrCat("chart", number); }
std::string FileName(std::size_t number) { return absl::StrCat(ChartName(number), ".svg"); }

/// Only the element, with ids that no other chart on the page has.
std::string ToInline(const std::string& document, std::size_t number) {
  const std::string name = ChartName(number);
  const std::size_t begin = document.find("<svg");
  return absl::StrReplaceAll(document.substr(begin == std::string::npos ? 0 : begin),
                             {{"'gpPt", absl::StrCat("'", name, "_p")},
                              {"#gpPt", absl::StrCat("#", name, "_p")},
                              {"'gpDot'", absl::StrCat("'", name, "_dot'")},
                              {"#gpDot'", absl::StrCat("#", name, "_dot'")},
                              {"'textbox'", absl::StrCat("'", name, "_textbox'")},
                              {"'greybox'", absl::StrCat("'", name, "_greybox'")},
                              {"\"gnuplot_canvas\"", absl::StrCat("\"", name, "_canvas\"")},
                              // A tip over every line that tells its number only.
                              {absl::StrCat("<title>", name, "</title>\n"), ""},
                              {"\t", ""}});
}

/// Names that are too long for a legend are cut, between letters.
std::string TitleOf(const std::string& name) {
  if (name.empty()) return "notitle";
  constexpr std::size_t kMaxBytes = 32;
  if (name.size() <= kMaxBytes) return absl::StrCat("title ", GnuplotQuoted(name));
  std::size_t end = kMaxBytes - 3;
  const auto goes_on = [&] { return (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80; };
  while (end > 0 && goes_on()) --end;
  return absl::StrCat("title ", GnuplotQuoted(name.substr(0, end) + "..."));
}

/// How the series is plotted, behind the name of its data.
std::string PlotOf(const ChartSeries& series, bool in_space) {
  const std::string color = absl::StrCat(" lc rgb ", GnuplotQuoted(series.color));
  const std::string line = absl::StrFormat("%s lw %g dt %d ", color, series.width, series.dash);
  const char* columns = in_space ? "using 1:2:3" : "using 1:2";
  switch (series.style) {
    case Style::kPath:
      return absl::StrCat(columns, " with lines", line, TitleOf(series.name));
    case Style::kSegments:
      return absl::StrCat(in_space ? "using 1:2:3:4:5:6" : "using 1:2:4:5", " with vectors nohead",
                          line, TitleOf(series.name));
    case Style::kMarks:
      return absl::StrFormat("%s with points%s pt %d ps %g lw %g %s", columns, color,
                             static_cast<int>(series.mark), series.mark_size, series.width,
                             TitleOf(series.name));
  }
  return "";
}

std::string CellsToText(const HeatMap& chart, std::size_t greatest, bool is_dark) {
  const auto edge = [](const ChartAxis& axis, std::size_t i, std::size_t num) {
    return axis.low + (axis.high - axis.low) * static_cast<double>(i) / static_cast<double>(num);
  };
  std::string text;
  for (std::size_t row = 0; row < chart.cells.size(); ++row) {
    const std::size_t num_columns = chart.cells[row].size();
    for (std::size_t column = 0; column < num_columns; ++column) {
      const std::size_t count = chart.cells[row][column];
      if (count == 0) continue;
      if ((static_cast<double>(count) > kDarkShare * static_cast<double>(greatest)) != is_dark) {
        continue;
      }
      const double x0 = edge(chart.x, column, num_columns);
      const double x1 = edge(chart.x, column + 1, num_columns);
      const double y0 = edge(chart.y, row, chart.cells.size());
      const double y1 = edge(chart.y, row + 1, chart.cells.size());
      absl::StrAppendFormat(&text, "%.6g %.6g %.6g %.6g %.6g %.6g %d\n", (x0 + x1) / 2.0,
                            (y0 + y1) / 2.0, x0, x1, y0, y1, count);
    }
  }
  return text;
}

/// 1, 2 or 5 times a power of ten: the least that makes at most four steps.
double TickStep(double length) {
  const double rough = length / 4.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= rough) return step * power;
  }
  return 10.0 * power;
}

/// For both of two axes of equal scale.
double TickStep(const ChartAxis& x, const ChartAxis& y) {
  return TickStep(std::max(x.high - x.low, y.high - y.low));
}

std::size_t CountNamed(const std::vector<ChartSeries>& series) {
  return static_cast<std::size_t>(std::count_if(
      series.begin(), series.end(),
      [](const ChartSeries& one) { return !one.name.empty() && !one.points.empty(); }));
}

}  // namespace

void SetLook(std::size_t i, ChartSeries* series) {
  constexpr std::array kColors = {colors::kBlue,   colors::kVermilion, colors::kGreen,
                                  colors::kPurple, colors::kOrange,    colors::kSky,
                                  colors::kBlack};
  constexpr std::size_t kNumDashes = 5;
  series->color = kColors[i % kColors.size()];
  series->dash = static_cast<int>((i + i / kColors.size()) % kNumDashes) + 1;
}

std::size_t ChartSheet::Begin(double width_px, double height_px) {
  const std::size_t number = num_charts_++;
  absl::StrAppendFormat(&script_,
                        "reset\n"
                        "set terminal svg size %d,%d dynamic noenhanced name '%s' "
                        "font 'sans-serif,13' background '#ffffff'\n"
                        "set output '%s'\n"
                        "set key noenhanced above Left reverse samplen 3 spacing 1.2\n"
                        "set grid lc rgb '#dddddd' lt 1 lw 1\n"
                        "set border lc rgb '#666666'\n"
                        "set tics nomirror out textcolor rgb '#222222'\n",
                        static_cast<int>(width_px), static_cast<int>(height_px), ChartName(number),
                        FileName(number));
  return number;
}

void ChartSheet::SetAxis(const char* letter, const ChartAxis& axis) {
  absl::StrAppendFormat(&script_, "set %slabel %s\nset %srange [%.7g:%.7g]\n", letter,
                        GnuplotQuoted(axis.title), letter, axis.low, axis.high);
}

std::string ChartSheet::AddData(const ChartSeries& series) {
  std::string name = absl::StrCat("$data", num_data_++);
  absl::StrAppend(&script_, name, " << EOD\n");
  const bool has_ends = series.style == Style::kSegments;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const Eigen::Vector3d& point = series.points[i];
    if (point.hasNaN()) {
      // Two blank lines: with one, gnuplot would join the pieces to a surface.
      script_ += "\n\n";
      continue;
    }
    absl::StrAppendFormat(&script_, "%.6g %.6g %.6g", point.x(), point.y(), point.z());
    if (has_ends) {
      const Eigen::Vector3d step = series.points[++i] - point;
      absl::StrAppendFormat(&script_, " %.6g %.6g %.6g", step.x(), step.y(), step.z());
    }
    script_ += '\n';
  }
  script_ += "EOD\n";
  return name;
}

void ChartSheet::Plot(const char* command, std::vector<std::string> parts) {
  // Axes alone where there is nothing to be drawn.
  if (parts.empty()) parts = {"NaN notitle"};
  absl::StrAppend(&script_, command, " ", absl::StrJoin(parts, ", "), "\nunset output\n");
}

std::size_t ChartSheet::Add(const LineChart& chart) {
  double height_px = kHeight_px;
  const std::size_t num_legend_rows = (CountNamed(chart.series) + 1) / 2;
  if (chart.has_equal_scales) {
    const double aspect = (chart.y.high - chart.y.low) / (chart.x.high - chart.x.low);
    height_px = std::clamp(aspect, 0.3, 1.2) * (kWidth_px - kBeside_px) + kAbove_px +
                kLegendRow_px * static_cast<double>(num_legend_rows);
  }
  const std::size_t number = Begin(kWidth_px, height_px);
  SetAxis("x", chart.x);
  SetAxis("y", chart.y);
  if (chart.has_equal_scales) {
    const double step = TickStep(chart.x, chart.y);
    absl::StrAppendFormat(&script_,
                          "set size ratio -1\nset key above vertical maxrows %d\n"
                          "set xtics %.7g\nset ytics %.7g\n",
                          num_legend_rows, step, step);
  }
  std::vector<std::string> parts;
  for (const ChartSeries& series : chart.series) {
    if (series.points.empty()) continue;
    parts.push_back(absl::StrCat(AddData(series), " ", PlotOf(series, false)));
  }
  Plot("plot", std::move(parts));
  return number;
}

std::size_t ChartSheet::Add(const SpaceChart& chart) {
  constexpr double kTurn_deg = 35.0;
  /// Found by looking: labels have room.
  constexpr double kFilling = 1.35;
  const double x_length = chart.x.high - chart.x.low;
  const double y_length = chart.y.high - chart.y.low;
  const double turn_rad = kTurn_deg * std::numbers::pi / 180.0;
  // Across the picture, of the longer side, which gnuplot makes fit.
  const double width = (x_length * std::cos(turn_rad) + y_length * std::sin(turn_rad)) /
                       std::max(x_length, y_length);
  const std::size_t number = Begin(kWidth_px, kWidth_px);
  SetAxis("x", chart.x);
  SetAxis("y", chart.y);
  SetAxis("z", chart.z);
  const double step = TickStep(chart.x, chart.y);
  absl::StrAppendFormat(&script_,
                        // As large as the canvas allows, below a legend of two rows.
                        "set key at screen 0.02, screen 0.98 left top vertical maxrows 2\n"
                        "set lmargin 0\nset rmargin 0\nset tmargin 0\nset bmargin 0\n"
                        "set origin 0.05,-0.035\n"
                        "set view 60,%g,%.3f,1.05\nset view equal xy\n"
                        "set xyplane at %.7g\n"
                        "set ylabel offset -2,0\nset zlabel rotate by 90 offset -1,0\n"
                        "set xtics %.7g offset 0,-0.3\nset ytics %.7g\nset ztics %.7g,%.7g\n"
                        "set grid xtics ytics ztics\n",
                        kTurn_deg, kFilling / width, chart.z.low, step, step, chart.tick_from,
                        TickStep(chart.z.high - chart.tick_from));
  std::vector<std::string> parts;
  for (const ChartSeries& series : chart.series) {
    if (series.points.empty()) continue;
    parts.push_back(absl::StrCat(AddData(series), " ", PlotOf(series, true)));
  }
  Plot("splot", std::move(parts));
  return number;
}

std::size_t ChartSheet::Add(const HeatMap& chart) {
  const std::size_t number = Begin(kWidth_px, kHeight_px);
  std::size_t greatest = 0;
  std::size_t longest = 0;
  for (const std::vector<std::size_t>& row : chart.cells) {
    longest = std::max(longest, row.size());
    for (const std::size_t cell : row) greatest = std::max(greatest, cell);
  }
  SetAxis("x", chart.x);
  SetAxis("y", chart.y);
  absl::StrAppendFormat(&script_,
                        "unset key\n"
                        "set style fill solid noborder\n"
                        "set palette defined (0 '#e5eff7', 0.5 '#4292c6', 1 '#08306b')\n"
                        "set cbrange [0:%d]\nset cblabel %s\n"
                        "set grid front\n",
                        std::max<std::size_t>(1, greatest), GnuplotQuoted(chart.count_title));
  // gnuplot would draw them outside the axes, too.
  constexpr const char* kSplit = "nohead front dt 2 lw 1.5\n";
  if (chart.x_split < chart.x.high) {
    absl::StrAppendFormat(&script_, "set arrow from %.6g, graph 0 to %.6g, graph 1 %s",
                          chart.x_split, chart.x_split, kSplit);
  }
  if (chart.y_split < chart.y.high) {
    absl::StrAppendFormat(&script_, "set arrow from graph 0, first %.6g to graph 1, first %.6g %s",
                          chart.y_split, chart.y_split, kSplit);
  }
  std::vector<std::string> parts;
  std::vector<std::string> numbers;
  for (const bool is_dark : {false, true}) {
    const std::string cells = CellsToText(chart, greatest, is_dark);
    if (cells.empty()) continue;
    const std::string name = absl::StrCat("$data", num_data_++);
    absl::StrAppend(&script_, name, " << EOD\n", cells, "EOD\n");
    parts.push_back(absl::StrCat(name, " using 1:2:3:4:5:6:7 with boxxyerror lc palette"));
    numbers.push_back(absl::StrCat(name, " using 1:2:7 with labels font ',11' textcolor rgb '",
                                   is_dark ? "#ffffff" : "#000000", "'"));
  }
  if (longest <= kMaxNumbered) std::move(numbers.begin(), numbers.end(), std::back_inserter(parts));
  Plot("plot", std::move(parts));
  return number;
}

std::size_t ChartSheet::Add(const BarChart& chart) {
  const std::size_t number = Begin(kWidth_px, kHeight_px);
  std::size_t greatest = 1;
  const std::string name = absl::StrCat("$data", num_data_++);
  absl::StrAppend(&script_, name, " << EOD\n");
  for (const BarChart::Bar& bar : chart.bars) {
    greatest = std::max(greatest, bar.count);
    absl::StrAppendFormat(&script_, "%.6g %d %.6g\n", (bar.low + bar.high) / 2.0, bar.count,
                          0.9 * (bar.high - bar.low));
  }
  script_ += "EOD\n";
  SetAxis("x", chart.x);
  SetAxis("y", chart.y);
  // Room for the number above the highest bar.
  SetAxis("y2", {chart.count_title, 0.0, 1.15 * static_cast<double>(greatest)});
  script_ += "set y2tics\nset style fill solid noborder\n";
  std::vector<std::string> parts = {
      absl::StrCat(name, " using 1:2:3 axes x1y2 with boxes lc rgb '#d9d9d9' ",
                   TitleOf(chart.count_title)),
      absl::StrCat(name, " using 1:2:2 axes x1y2 with labels offset 0,0.6 font ',12' ",
                   "textcolor rgb '#555555' notitle")};
  for (const ChartSeries& series : chart.series) {
    if (series.points.empty()) continue;
    parts.push_back(absl::StrCat(AddData(series), " ", PlotOf(series, false)));
  }
  Plot("plot", std::move(parts));
  return number;
}

absl::StatusOr<ChartSheet::Drawings> ChartSheet::Draw() const {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < num_charts_; ++i) files.push_back(FileName(i));
  absl::StatusOr<GnuplotOutput> output = RunGnuplot(script_, files);
  if (!output.ok()) return output.status();
  Drawings drawings{.svgs = {}, .warnings = std::move(output->warnings)};
  for (std::size_t i = 0; i < num_charts_; ++i) {
    drawings.svgs.push_back(ToInline(output->files[i], i));
  }
  return drawings;
}

}  // namespace scanloc::cli
