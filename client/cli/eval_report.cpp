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

std::optional<double> MedianOf(const std::optional<ErrorSummary>& error) {
  return error ? std::optional(error->median) : std::nullopt;
}

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json KindsToJson(const EvalReport& report, const MethodResult& result) {
  Json json = Json::object();
  for (std::size_t kind = 0; kind < kNumKinds; ++kind) {
    const auto [num, num_right] = CountKind(report, result, kind);
    Json& of_kind = json[eval::KindName(static_cast<eval::RevisitKind>(kind))];
    of_kind = {{"num_revisits", num}, {"recall_at_1", nullptr}, {"divergence_at_f1_max", nullptr}};
    if (num == 0) continue;
    of_kind["recall_at_1"] = static_cast<double>(num_right) / static_cast<double>(num);
    of_kind["divergence_at_f1_max"] = result.kind_divergence_at_f1_max[kind];
    of_kind["divergences"] = result.kind_divergences[kind];
  }
  return json;
}

Json ErrorToJson(const std::optional<ErrorSummary>& error) {
  if (!error) return nullptr;
  return {{"median", error->median}, {"mean", error->mean}, {"p90", error->p90}};
}

Json ResultToJson(const EvalReport& report, const MethodResult& result) {
  Json json;
  json["method"] = result.name;
  json["within_m"] = result.within_m;
  json["num_revisits"] = result.first_right.size();
  json["num_right_beyond"] = result.num_right_beyond;
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
  json["median_position_error_m"] = OrNull(MedianOf(result.position_m));
  json["p90_position_error_m"] = result.position_m ? Json(result.position_m->p90) : Json(nullptr);
  json["median_yaw_error_deg"] = OrNull(MedianOf(result.yaw_deg));
  json["p90_yaw_error_deg"] = result.yaw_deg ? Json(result.yaw_deg->p90) : Json(nullptr);
  json["position_error_m"] = ErrorToJson(result.position_m);
  json["lateral_error_m"] = ErrorToJson(result.lateral_m);
  json["yaw_error_deg"] = ErrorToJson(result.yaw_deg);
  json["mean_ms"] = result.times.total_ms;
  json["times_ms"] = {
      {"describe", result.times.describe_ms}, {"retrieve", result.times.retrieve_ms},
      {"match", result.times.match_ms},       {"verify", result.times.verify_ms},
      {"total", result.times.total_ms},       {"total_p99", result.times.total_p99_ms}};
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

constexpr std::array<const char*, 14> kColumns = {
    "method", "recall@1", "recall@5", "recall@10", "AUC",   "F1max",   "R@P100",
    "EP",     "KL",       "ECE",      "pos m",     "lat m", "yaw deg", "ms"};

constexpr std::array<const char*, 7> kTimeColumns = {"ms a query", "describe", "retrieve", "match",
                                                     "verify",     "total",    "p99"};

std::vector<std::string> RowOf(const MethodResult& result) {
  std::optional<double> error;
  if (result.reliability) error = result.reliability->expected_calibration_error;
  const eval::PrecisionRecall& curve = result.precision_recall;
  return {result.name,
          absl::StrFormat("%.3f", eval::RecallAt(1, result.first_right)),
          absl::StrFormat("%.3f", eval::RecallAt(5, result.first_right)),
          absl::StrFormat("%.3f", eval::RecallAt(10, result.first_right)),
          absl::StrFormat("%.3f", curve.area),
          absl::StrFormat("%.3f", curve.f1_max),
          absl::StrFormat("%.3f", curve.recall_at_full_precision),
          absl::StrFormat("%.3f", curve.extended_precision),
          absl::StrFormat("%.3f", result.divergence_at_f1_max),
          OrDash(error, 3),
          OrDash(MedianOf(result.position_m), 2),
          OrDash(MedianOf(result.lateral_m), 2),
          OrDash(MedianOf(result.yaw_deg), 2),
          absl::StrFormat("%.2f", result.times.total_ms)};
}

}  // namespace

std::string EvalAsTable(const EvalReport& report, bool with_times) {
  std::string text = EvalSummary(report) + "\n";
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
  double within_m = report.within_m;
  append(kColumns);
  for (const MethodResult& result : report.results) {
    if (result.within_m != within_m) {
      within_m = result.within_m;
      absl::StrAppendFormat(&text, "within %g m: %d revisits\n", within_m,
                            result.first_right.size());
    }
    append(RowOf(result));
  }
  if (!with_times) return text;
  append(kTimeColumns);
  for (const MethodResult& result : report.results) {
    if (result.within_m != report.within_m) break;
    std::vector<std::string> row = {result.name};
    const StageMeans& times = result.times;
    for (const double ms : {times.describe_ms, times.retrieve_ms, times.match_ms, times.verify_ms,
                            times.total_ms, times.total_p99_ms}) {
      row.push_back(absl::StrFormat("%.3f", ms));
    }
    append(row);
  }
  return text;
}

KindCount CountKind(const EvalReport& report, const MethodResult& result, std::size_t kind) {
  KindCount count;
  for (std::size_t i = 0; i < report.queries.size(); ++i) {
    if (!result.scored[i].is_revisit ||
        eval::KindOf(report.queries[i].variance) != static_cast<eval::RevisitKind>(kind)) {
      continue;
    }
    ++count.num_revisits;
    count.num_right += result.scored[i].is_right ? 1 : 0;
  }
  return count;
}

std::string EvalSummary(const EvalReport& report) {
  const Counts counts = CountQueries(report);
  return absl::StrFormat("%d queries: %d revisits within %g m, %d taken elsewhere",
                         report.queries.size(), counts.num_revisits, report.within_m,
                         counts.num_elsewhere);
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
    if (result.within_m != report.within_m) break;
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
