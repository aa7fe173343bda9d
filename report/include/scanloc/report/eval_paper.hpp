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

/// What a paper takes from an evaluation: every chart as `figures/NAME.svg`, the numbers of the
/// curves as `figures/curves.csv` and those of the reliabilities as `figures/reliability.csv`, and
/// the table of results as `tables.tex` (booktabs).
[[nodiscard]] std::vector<ReportFile> PaperFiles(const EvalReport& report);

}  // namespace scanloc::report
