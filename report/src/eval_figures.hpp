#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/report/chart.hpp"
#include "scanloc/report/eval_report.hpp"

namespace scanloc::report {

/// One chart of the page.
struct EvalFigure {
  std::string title;
  std::string note;  ///< what the chart does not tell by itself; may be empty
  std::string svg;
  std::string csv;  ///< what it shows
};

template <typename Chart>
[[nodiscard]] EvalFigure FigureOf(std::string title, std::string note, const Chart& chart) {
  return {std::move(title), std::move(note), Draw(chart), AsCsv(chart)};
}

/// The results for one within_m.
[[nodiscard]] std::vector<const eval::MethodResult*> ResultsWithin(const EvalReport& report,
                                                                   double within_m);

/// `easy`, `lateral`, `rotational` or `lateral and rotational`.
[[nodiscard]] std::string KindTitle(std::size_t kind);

/// Precision over recall, F1 over recall, reliability, distribution of the revisits and what is
/// found of it, overall and by kind. Only the results of the report's within_m are drawn.
[[nodiscard]] std::vector<EvalFigure> DrawCurves(const EvalReport& report);

/// The method's matches from above at its greatest F1, and over time there and at 100 % precision.
[[nodiscard]] std::vector<EvalFigure> DrawMatches(const EvalReport& report,
                                                  const eval::MethodResult& result);

}  // namespace scanloc::report
