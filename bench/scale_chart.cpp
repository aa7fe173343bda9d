// Draws how a query's cost grows with the map, of the lines that scale_bench prints: those of whole
// queries, and those of retrieval alone (--keys).
#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/report/chart.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::bench {
namespace {

/// A column over that of places, by how many digits there are.
absl::Status AppendSeries(const std::string& file, const std::string& column,
                          report::ChartSeries series, std::vector<report::ChartSeries>& drawn) {
  std::ifstream stream(file);
  if (!stream) return absl::NotFoundError("cannot read " + file);
  std::stringstream text;
  text << stream.rdbuf();
  ASSIGN_OR_RETURN(const auto table, report::CsvTable::Parse(text.str()));
  for (const std::string& name : {std::string("places"), column}) {
    if (!table.HasColumn(name)) return absl::InvalidArgumentError(file + " has no " + name);
  }
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    const auto places = table.Number(row, "places");
    const auto ms = table.Number(row, column);
    for (const absl::Status& status : {places.status(), ms.status()}) {
      if (!status.ok()) return status;
    }
    if (!*places || **places < 1.0 || !*ms || **ms <= 0.0) {
      return absl::InvalidArgumentError(absl::StrCat(file, ": row ", row + 1, " measures nothing"));
    }
    series.points.emplace_back(std::log10(**places), std::log10(**ms), 0.0);
  }
  report::ChartSeries marks = series;
  marks.name.clear();
  marks.style = report::ChartSeries::Style::kMarks;
  drawn.push_back(std::move(series));
  drawn.push_back(std::move(marks));
  return absl::OkStatus();
}

absl::StatusOr<std::string> Chart(const std::string& maps, const std::string& keys) {
  report::LineChart chart{.x = {"places of the map, as a power of ten", 2.9, 7.1},
                          .y = {"ms of processor, median, as a power of ten", -0.5, 2.5},
                          .series = {},
                          .title = "A query with auto as the map grows",
                          .width_px = 560.0};
  const std::pair<const char*, report::ChartSeries> lines[] = {
      {"cpu_p50_ms", {.name = "whole query", .color = report::colors::kBlue}},
      {"retrieve_p50_ms", {.name = "its retrieval", .color = report::colors::kGreen}},
      {"retrieve_cpu_p50_ms",
       {.name = "retrieval, keys alone", .color = report::colors::kGreen, .dash = 2}},
      {"exact_cpu_p50_ms",
       {.name = "the same, exact", .color = report::colors::kVermilion, .dash = 2}}};
  for (std::size_t i = 0; i < std::size(lines); ++i) {
    const auto& [column, series] = lines[i];
    RETURN_IF_ERROR(AppendSeries(i < 2 ? maps : keys, column, series, chart.series));
  }
  return report::Draw(chart);
}

}  // namespace
}  // namespace scanloc::bench

int main(int argc, char** argv) {
  std::string maps, keys;
  CLI::App app("Draws how a query's cost grows with the map, as SVG on standard output.");
  app.add_option("MAPS", maps, "CSV of scale_bench, a row a map")->required();
  app.add_option("KEYS", keys, "CSV of scale_bench --keys")->required();
  CLI11_PARSE(app, argc, argv);
  const auto svg = scanloc::bench::Chart(maps, keys);
  if (!svg.ok()) {
    std::cerr << svg.status() << "\n";
    return 1;
  }
  std::cout << *svg;
  return 0;
}
