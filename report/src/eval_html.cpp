#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "eval_figures.hpp"
#include "page.hpp"
#include "scanloc/report/eval_report.hpp"
#include "svg.hpp"

namespace scanloc::report {
namespace {

using Row = std::vector<std::string>;

constexpr const char* kExplanation =
    "<p>AUC: area under precision over recall. P@F1, R@F1: precision and recall at the greatest "
    "F1. R@P100: recall at 100 % precision. EP: extended precision. KL: divergence of the revisits "
    "found from all, at the greatest F1. ECE: expected calibration error. pos, lat, yaw: median "
    "errors of right matches. ms: mean processor time to describe and search. Recall counts all "
    "revisits; a wrong match counts against precision whether its query is a revisit or not.</p>\n";

/// A row a method.
std::string Table(const Row& columns, const std::vector<const eval::MethodResult*>& results,
                  Row (*row_of)(const eval::MethodResult&)) {
  std::vector<Row> rows;
  for (const eval::MethodResult* result : results) rows.push_back(row_of(*result));
  return HtmlTable(columns, rows);
}

Row ErrorRow(const eval::MethodResult& result) {
  Row row = {result.name};
  for (const std::optional<eval::ErrorSummary>& error :
       {result.position_m, result.lateral_m, result.yaw_deg}) {
    if (!error) row.insert(row.end(), {"-", "-", "-"});
    if (!error) continue;
    for (const double value : {error->mean, error->median, error->p90}) {
      row.push_back(absl::StrFormat("%.3f", value));
    }
  }
  return row;
}

Row TimeRow(const eval::MethodResult& result) {
  Row row = {result.name};
  const eval::StageMeans& times = result.times;
  for (const double ms : {times.describe_ms, times.retrieve_ms, times.match_ms, times.verify_ms,
                          times.total_ms, times.total_p99_ms}) {
    row.push_back(absl::StrFormat("%.3f", ms));
  }
  return row;
}

std::string KindTable(const EvalReport& report,
                      const std::vector<const eval::MethodResult*>& results) {
  Row columns = {"method"};
  for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
    columns.push_back(absl::StrCat(
        KindTitle(kind), " (",
        results.empty() ? 0 : CountKind(report, *results.front(), kind).num_revisits, ")"));
  }
  std::vector<Row> rows;
  for (const eval::MethodResult* result : results) {
    rows.push_back({result->name});
    for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
      const KindCount count = CountKind(report, *result, kind);
      rows.back().push_back(
          count.num_revisits == 0
              ? "-"
              : absl::StrFormat("%.3f", static_cast<double>(count.num_right) /
                                            static_cast<double>(count.num_revisits)));
    }
  }
  return HtmlTable(columns, rows);
}

std::string Tables(const EvalReport& report) {
  const std::vector<const eval::MethodResult*> results = ResultsWithin(report, report.within_m);
  std::string html =
      absl::StrCat("<h2>Results</h2>\n", Table(EvalColumns(), results, EvalRow), kExplanation);
  double told_m = report.within_m;
  for (const eval::MethodResult& result : report.results) {
    if (result.within_m == told_m) continue;
    told_m = result.within_m;
    absl::StrAppend(&html, "<h2>Results within ", told_m, " m (", result.first_right.size(),
                    " revisits)</h2>\n",
                    Table(EvalColumns(), ResultsWithin(report, told_m), EvalRow));
  }
  absl::StrAppend(
      &html, "<h2>Recall@1 by kind of revisit (their number)</h2>\n", KindTable(report, results),
      "<h2>Answers by their pose: within 1 m, 1 m of "
      "height and 10 degrees of heading</h2>\n",
      Table({"method", "localized and right", "false", "missed in the plane", "in height",
             "in heading", "ambiguous", "not recognised", "too few points"},
            results, OutcomeRow),
      "<h2>Errors of right matches</h2>\n",
      Table({"method", "pos mean [m]", "median [m]", "90 % [m]", "lat mean [m]", "median [m]",
             "90 % [m]", "yaw mean [deg]", "median [deg]", "90 % [deg]"},
            results, ErrorRow),
      "<h2>Mean time of each stage a query, one thread</h2>\n",
      Table({"method", "describe [ms]", "retrieve [ms]", "match [ms]", "verify [ms]", "total [ms]",
             "99 % of totals [ms]"},
            results, TimeRow));
  return html;
}

std::string Figures(const std::string& title, const std::vector<EvalFigure>& figures) {
  std::string html = absl::StrCat("<h2>", XmlEscaped(title), "</h2>\n<div class=\"charts\">\n");
  for (const EvalFigure& figure : figures) {
    absl::StrAppend(&html, "<figure><figcaption><b>", XmlEscaped(figure.title), "</b>",
                    XmlEscaped(figure.note), "</figcaption>\n", figure.svg, "</figure>\n");
  }
  return html + "</div>\n";
}

}  // namespace

std::string EvalAsHtml(const EvalReport& report) {
  std::string html = PageHead("scanloc evaluation");
  absl::StrAppend(&html, "<h1>scanloc evaluation</h1>\n<p>Map <code>", XmlEscaped(report.map),
                  "</code>, content id <code>", XmlEscaped(report.content_id), "</code>. ",
                  XmlEscaped(EvalSummary(report)), ". A match is right if its place lies within ",
                  report.within_m, " m of the query's true position.</p>\n");
  if (!report.made.version.empty()) {
    absl::StrAppend(&html, "<p>Made by scanloc ", XmlEscaped(report.made.version), " on ",
                    XmlEscaped(report.made.date), ": <code>", XmlEscaped(report.made.command),
                    "</code>. Charts and their numbers as files: <code>figures/</code>; the table "
                    "for LaTeX: <code>tables.tex</code>.</p>\n");
  }
  html += Tables(report);
  html += Figures("Curves", DrawCurves(report));
  for (const eval::MethodResult* result : ResultsWithin(report, report.within_m)) {
    html += Figures(absl::StrCat("Matches of ", result->name), DrawMatches(report, *result));
  }
  return html + "</body></html>\n";
}

}  // namespace scanloc::report
