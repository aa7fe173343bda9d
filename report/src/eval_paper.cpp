#include "scanloc/report/eval_paper.hpp"

#include <cctype>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "eval_figures.hpp"

namespace scanloc::report {
namespace {

/// Letters, digits and single hyphens of the text, in lower case.
std::string FileNameOf(const std::string& title) {
  std::string name;
  for (const unsigned char c : title) {
    if (std::isalnum(c) != 0 && c < 128) {
      name += static_cast<char>(std::tolower(c));
    } else if (!name.empty() && name.back() != '-') {
      name += '-';
    }
  }
  while (!name.empty() && name.back() == '-') name.pop_back();
  return name;
}

std::string TexEscaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\textbackslash{}";
    } else if (c == '~' || c == '^') {
      absl::StrAppend(&escaped, "\\", std::string(1, c), "{}");
    } else {
      if (std::string_view("&%$#_{}").find(c) != std::string_view::npos) escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

/// The methods as they are told apart: "a-pc within 8 m" where there is more than one such
/// distance.
std::string CurvesCsv(const EvalReport& report) {
  std::string csv = "method,within_m,threshold,recall,precision,f1,divergence\n";
  for (const eval::MethodResult& result : report.results) {
    const auto& points = result.precision_recall.points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      absl::StrAppendFormat(&csv, "%s,%g,%.17g,%.6f,%.6f,%.6f,%.6f\n", result.name, result.within_m,
                            points[i].threshold, points[i].recall, points[i].precision,
                            points[i].f1, result.divergences[i]);
    }
  }
  return csv;
}

std::string TexRow(const std::vector<std::string>& cells) {
  std::string row;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    absl::StrAppend(&row, i == 0 ? "" : " & ", TexEscaped(cells[i]));
  }
  return row + " \\\\\n";
}

/// Methods as rows, as the paper's tables have them.
std::string ResultsTex(const EvalReport& report) {
  const std::vector<std::string> columns = EvalColumns();
  std::string tex = absl::StrCat(
      "% ", EvalSummary(report), "\n% content id ", report.content_id, "; right within ",
      report.within_m, " m\n% needs \\usepackage{booktabs}\n", "\\begin{tabular}{l",
      std::string(columns.size() - 1, 'r'), "}\n\\toprule\n", TexRow(columns), "\\midrule\n");
  for (const eval::MethodResult* result : ResultsWithin(report, report.within_m)) {
    tex += TexRow(EvalRow(*result));
  }
  return tex + "\\bottomrule\n\\end{tabular}\n";
}

}  // namespace

std::vector<ReportFile> PaperFiles(const EvalReport& report) {
  std::vector<ReportFile> files = {{"figures/curves.csv", CurvesCsv(report)},
                                   {"tables.tex", ResultsTex(report)}};
  const auto add = [&files](const std::vector<EvalFigure>& figures) {
    for (const EvalFigure& figure : figures) {
      const std::string path = absl::StrCat("figures/", FileNameOf(figure.title));
      files.push_back({path + ".svg", absl::StrCat(figure.svg, "\n")});
      files.push_back({path + ".csv", figure.csv});
    }
  };
  add(DrawCurves(report));
  for (const eval::MethodResult* result : ResultsWithin(report, report.within_m)) {
    add(DrawMatches(report, *result));
  }
  return files;
}

}  // namespace scanloc::report
