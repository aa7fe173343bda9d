#include "cli/eval_report.hpp"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/csv.hpp"
#include "cli/json.hpp"

namespace scanloc::cli {
namespace {

struct Counts {
  std::size_t num_revisits = 0;
  std::size_t num_elsewhere = 0;  ///< no revisits
};

Counts CountQueries(const EvalReport& report) {
  Counts counts;
  for (const EvalQuery& query : report.queries) {
    ++(query.is_revisit ? counts.num_revisits : counts.num_elsewhere);
  }
  return counts;
}

std::string OrDash(const std::optional<double>& value, int decimals) {
  return value ? absl::StrFormat("%.*f", decimals, *value) : "-";
}

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json KindsToJson(const EvalReport& report, const MethodResult& result) {
  Json json = Json::object();
  for (const eval::RevisitKind kind : {eval::RevisitKind::kEasy, eval::RevisitKind::kLateral,
                                       eval::RevisitKind::kRotational, eval::RevisitKind::kBoth}) {
    std::size_t num = 0;
    std::size_t num_right = 0;
    for (std::size_t i = 0; i < report.queries.size(); ++i) {
      if (!report.queries[i].is_revisit || eval::KindOf(report.queries[i].variance) != kind) {
        continue;
      }
      ++num;
      num_right += result.scored[i].is_right ? 1 : 0;
    }
    json[eval::KindName(kind)] = {{"num_revisits", num},
                                  {"recall_at_1", num == 0 ? Json(nullptr)
                                                           : Json(static_cast<double>(num_right) /
                                                                  static_cast<double>(num))}};
  }
  return json;
}

Json ResultToJson(const EvalReport& report, const MethodResult& result) {
  Json json;
  json["method"] = result.name;
  for (const int k : {1, 5, 10}) {
    json[absl::StrCat("recall_at_", k)] = eval::RecallAt(k, result.first_right);
  }
  json["area_under_curve"] = result.precision_recall.area;
  json["f1_max"] = result.precision_recall.f1_max;
  json["threshold_at_f1_max"] = result.threshold_at_f1_max;
  json["recall_at_full_precision"] = result.precision_recall.recall_at_full_precision;
  json["extended_precision"] = result.precision_recall.extended_precision;
  json["divergence_at_f1_max"] = result.divergence_at_f1_max;
  json["expected_calibration_error"] =
      result.reliability ? Json(result.reliability->expected_calibration_error) : Json(nullptr);
  json["median_position_error_m"] = OrNull(result.median_position_m);
  json["p90_position_error_m"] = OrNull(result.p90_position_m);
  json["median_yaw_error_deg"] = OrNull(result.median_yaw_deg);
  json["p90_yaw_error_deg"] = OrNull(result.p90_yaw_deg);
  json["mean_ms"] = result.mean_ms;
  json["kinds"] = KindsToJson(report, result);
  json["curve"] = Json::array();
  for (std::size_t i = 0; i < result.precision_recall.points.size(); ++i) {
    const eval::OperatingPoint& point = result.precision_recall.points[i];
    json["curve"].push_back({{"threshold", point.threshold},
                             {"precision", point.precision},
                             {"recall", point.recall},
                             {"f1", point.f1},
                             {"divergence", result.divergences[i]}});
  }
  return json;
}

constexpr std::array<const char*, 12> kColumns = {"method", "recall@1", "recall@10", "AUC",
                                                  "F1max",  "R@P100",   "EP",        "KL",
                                                  "ECE",    "pos m",    "yaw deg",   "ms"};

std::vector<std::string> RowOf(const MethodResult& result) {
  std::optional<double> error;
  if (result.reliability) error = result.reliability->expected_calibration_error;
  const eval::PrecisionRecall& curve = result.precision_recall;
  return {result.name,
          absl::StrFormat("%.3f", eval::RecallAt(1, result.first_right)),
          absl::StrFormat("%.3f", eval::RecallAt(10, result.first_right)),
          absl::StrFormat("%.3f", curve.area),
          absl::StrFormat("%.3f", curve.f1_max),
          absl::StrFormat("%.3f", curve.recall_at_full_precision),
          absl::StrFormat("%.3f", curve.extended_precision),
          absl::StrFormat("%.3f", result.divergence_at_f1_max),
          OrDash(error, 3),
          OrDash(result.median_position_m, 2),
          OrDash(result.median_yaw_deg, 2),
          absl::StrFormat("%.2f", result.mean_ms)};
}

}  // namespace

std::string EvalAsTable(const EvalReport& report) {
  const Counts counts = CountQueries(report);
  std::string text = absl::StrFormat("%d queries: %d revisits within %g m, %d taken elsewhere\n",
                                     report.queries.size(), counts.num_revisits, report.within_m,
                                     counts.num_elsewhere);
  const auto append = [&](const auto& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i == 0) {
        absl::StrAppendFormat(&text, "%-14s", std::string(row[i]));
      } else {
        absl::StrAppendFormat(&text, "%10s", std::string(row[i]));
      }
    }
    text += '\n';
  };
  append(kColumns);
  for (const MethodResult& result : report.results) append(RowOf(result));
  return text;
}

std::string EvalAsJson(const EvalReport& report) {
  const Counts counts = CountQueries(report);
  Json json;
  json["map"] = report.map;
  json["content_id"] = report.content_id;
  json["within_m"] = report.within_m;
  json["num_queries"] = report.queries.size();
  json["num_revisits"] = counts.num_revisits;
  json["num_elsewhere"] = counts.num_elsewhere;
  json["results"] = Json::array();
  for (const MethodResult& result : report.results) {
    json["results"].push_back(ResultToJson(report, result));
  }
  return ToText(json);
}

std::string EvalAsCsv(const EvalReport& report) {
  std::string csv =
      CsvRow({"query", "method", "is_revisit", "has_match", "is_right", "score", "x", "y"});
  for (const MethodResult& result : report.results) {
    for (std::size_t i = 0; i < report.queries.size(); ++i) {
      const eval::ScoredQuery& scored = result.scored[i];
      csv += CsvRow({report.queries[i].name, result.name, scored.is_revisit ? "1" : "0",
                     scored.has_match ? "1" : "0", scored.is_right ? "1" : "0",
                     scored.has_match ? FixedText(scored.score, 6) : "",
                     scored.has_match ? FixedText(result.matched_m[i].x(), 3) : "",
                     scored.has_match ? FixedText(result.matched_m[i].y(), 3) : ""});
    }
  }
  return csv;
}

std::vector<std::string> EvalColumns() { return {kColumns.begin(), kColumns.end()}; }
std::vector<std::string> EvalRow(const MethodResult& result) { return RowOf(result); }

}  // namespace scanloc::cli
