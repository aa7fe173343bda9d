#pragma once

#include <string>
#include <vector>

#include "scanloc/report/eval_report.hpp"

namespace scanloc::report {

/// A file of a report, by its name in the report's folder.
struct ReportFile {
  std::string name;
  std::string text;
};

/// What a paper takes from an evaluation: every chart as `figures/NAME.svg` and what it shows
/// as `figures/NAME.csv`; the whole curves with their thresholds, of all limits, as
/// `figures/curves.csv`; the table of results as `tables.tex` (booktabs).
[[nodiscard]] std::vector<ReportFile> PaperFiles(const EvalReport& report);

}  // namespace scanloc::report
