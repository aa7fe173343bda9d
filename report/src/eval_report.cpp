#include "scanloc/report/eval_report.hpp"

#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "eval_figures.hpp"
#include "outcome_json.hpp"
#include "scanloc/report/csv.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::report {
namespace {

struct Counts {
  std::size_t num_revisits = 0;
  std::size_t num_elsewhere = 0;  ///< no revisits
};

Counts CountQueries(const EvalReport& report) {
  Counts counts;
  for (const eval::EvalQuery& query : report.queries) {
    ++(query.is_revisit ? counts.num_revisits : counts.num_elsewhere);
  }
  return counts;
}

std::string OrDash(const std::optional<double>& value, int decimals) {
  return value ? absl::StrFormat("%.*f", decimals, *value) : "-";
}

std::optional<double> MedianOf(const std::optional<eval::ErrorSummary>& error) {
  return error ? std::optional(error->median) : std::nullopt;
}

std::optional<double> Recall(const eval::MethodResult& result, int k) {
  return eval::RecallAt(k, result.first_right, result.num_candidates);
}

/// The point of the greatest F1; null without.
const eval::OperatingPoint* BestPoint(const eval::MethodResult& result) {
  const eval::PrecisionRecall& curve = result.precision_recall;
  return curve.best ? &curve.points[*curve.best] : nullptr;
}

/// Of measures that say nothing where there are no revisits.
std::optional<double> OfRevisits(const eval::MethodResult& result, double measure) {
  return result.first_right.empty() ? std::nullopt : std::optional(measure);
}

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json KindsToJson(const EvalReport& report, const eval::MethodResult& result) {
  Json json = Json::object();
  for (std::size_t kind = 0; kind < eval::kNumKinds; ++kind) {
    const auto [num, num_right] = CountKind(report, result, kind);
    Json& of_kind = json[eval::KindName(static_cast<eval::RevisitKind>(kind))];
    of_kind = {{"num_revisits", num}, {"recall_at_1", nullptr}, {"divergence_at_f1_max", nullptr}};
    if (num == 0) continue;
    of_kind["recall_at_1"] = static_cast<double>(num_right) / static_cast<double>(num);
    of_kind["divergence_at_f1_max"] = OrNull(result.kind_divergence_at_f1_max[kind]);
    of_kind["divergences"] = result.kind_divergences[kind];
  }
  return json;
}

Json ErrorToJson(const std::optional<eval::ErrorSummary>& error) {
  if (!error) return nullptr;
  return {{"median", error->median}, {"mean", error->mean}, {"p90", error->p90}};
}

Json ResultToJson(const EvalReport& report, const eval::MethodResult& result) {
  Json json;
  json["method"] = result.name;
  json["within_m"] = result.within_m;
  json["num_revisits"] = result.first_right.size();
  json["num_right_beyond"] = result.num_right_beyond;
  AddOutcomes(result.outcomes, &json);
  AddRightAndFalse(result.outcomes, &json);
  for (const int k : {1, 5, 10}) {
    json[absl::StrCat("recall_at_", k)] = OrNull(Recall(result, k));
  }
  const eval::PrecisionRecall& curve = result.precision_recall;
  const eval::OperatingPoint* best = BestPoint(result);
  json["area_under_curve"] = OrNull(OfRevisits(result, curve.area));
  json["f1_max"] = OrNull(OfRevisits(result, curve.f1_max));
  json["threshold_at_f1_max"] = best != nullptr ? Json(best->threshold) : Json(nullptr);
  json["precision_at_f1_max"] = best != nullptr ? Json(best->precision) : Json(nullptr);
  json["recall_at_f1_max"] = best != nullptr ? Json(best->recall) : Json(nullptr);
  json["recall_at_full_precision"] = OrNull(OfRevisits(result, curve.recall_at_full_precision));
  json["extended_precision"] = OrNull(OfRevisits(result, curve.extended_precision));
  json["divergence_at_f1_max"] = OrNull(result.divergence_at_f1_max);
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
      {"describe", result.times.describe_ms},  {"describe_place", result.times.describe_place_ms},
      {"retrieve", result.times.retrieve_ms},  {"match", result.times.match_ms},
      {"verify", result.times.verify_ms},      {"total", result.times.total_ms},
      {"total_p99", result.times.total_p99_ms}};
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

constexpr std::array<const char*, 16> kColumns = {
    "method", "recall@1", "recall@5", "recall@10", "AUC",   "F1max", "P@F1",    "R@F1",
    "R@P100", "EP",       "KL",       "ECE",       "pos m", "lat m", "yaw deg", "ms"};

constexpr std::array<const char*, 10> kErrorColumns = {
    "of matches", "pos m", "mean", "90 %", "lat m", "mean", "90 %", "yaw deg", "mean", "90 %"};

/// Localized and right in the plane, in height and in heading, or false: by which of these.
constexpr std::array<const char*, 9> kOutcomeColumns = {
    "of poses", "right", "false", "plane", "height", "heading", "ambiguous", "unknown", "too few"};

constexpr std::array<const char*, 8> kTimeColumns = {
    "ms a query", "describe", "(place)", "retrieve", "match", "verify", "total", "p99"};

std::vector<std::string> ErrorRowOf(const eval::MethodResult& result) {
  std::vector<std::string> row = {result.name};
  for (const auto& error : {result.position_m, result.lateral_m, result.yaw_deg}) {
    row.push_back(OrDash(MedianOf(error), 2));
    row.push_back(OrDash(error ? std::optional(error->mean) : std::nullopt, 2));
    row.push_back(OrDash(error ? std::optional(error->p90) : std::nullopt, 2));
  }
  return row;
}

std::vector<std::string> TimeRowOf(const eval::MethodResult& result) {
  std::vector<std::string> row = {result.name};
  const eval::StageMeans& times = result.times;
  for (const double ms : {times.describe_ms, times.describe_place_ms, times.retrieve_ms,
                          times.match_ms, times.verify_ms, times.total_ms, times.total_p99_ms}) {
    row.push_back(absl::StrFormat("%.3f", ms));
  }
  return row;
}

template <typename Row>
void AppendRow(const Row& row, std::string* text) {
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (i == 0) {
      absl::StrAppendFormat(text, "%-14s", std::string(row[i]));
    } else {
      absl::StrAppendFormat(text, "%10s", std::string(row[i]));
    }
  }
  *text += '\n';
}

/// What the table's precision may make one think wrongly of.
void AppendRightBeyond(const eval::MethodResult& result, std::string* text) {
  if (result.num_right_beyond == 0) return;
  absl::StrAppendFormat(text,
                        "%s: %d answers that count as wrong tell the right pose; no place lies "
                        "within %g m of the query\n",
                        result.name, result.num_right_beyond, result.within_m);
}

}  // namespace

std::string EvalAsTable(const EvalReport& report, bool with_times) {
  std::string text = EvalSummary(report) + "\n";
  double within_m = report.within_m;
  AppendRow(kColumns, &text);
  for (const eval::MethodResult& result : report.results) {
    if (result.within_m != within_m) {
      within_m = result.within_m;
      absl::StrAppendFormat(&text, "within %g m: %d revisits\n", within_m,
                            result.first_right.size());
    }
    AppendRow(EvalRow(result), &text);
  }
  for (const eval::MethodResult& result : report.results) AppendRightBeyond(result, &text);
  const auto append_main = [&](const auto& columns, const auto& row_of) {
    AppendRow(columns, &text);
    for (const auto* result : ResultsWithin(report, report.within_m)) {
      AppendRow(row_of(*result), &text);
    }
  };
  append_main(kOutcomeColumns, OutcomeRow);
  append_main(kErrorColumns, ErrorRowOf);
  if (with_times) append_main(kTimeColumns, TimeRowOf);
  return text;
}

std::vector<const eval::MethodResult*> ResultsWithin(const EvalReport& report, double within_m) {
  std::vector<const eval::MethodResult*> results;
  for (const eval::MethodResult& result : report.results) {
    if (result.within_m == within_m) results.push_back(&result);
  }
  return results;
}

KindCount CountKind(const EvalReport& report, const eval::MethodResult& result, std::size_t kind) {
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
  if (!report.made.version.empty()) {
    json["made"] = {{"version", report.made.version},
                    {"command", report.made.command},
                    {"date", report.made.date}};
  }
  json["map"] = report.map;
  json["content_id"] = report.content_id;
  json["mount"] = MountToJson(report.mount);
  json["within_m"] = report.within_m;
  json["num_queries"] = report.queries.size();
  json["num_revisits"] = counts.num_revisits;
  json["num_elsewhere"] = counts.num_elsewhere;
  json["results"] = Json::array();
  for (const eval::MethodResult& result : report.results) {
    json["results"].push_back(ResultToJson(report, result));
  }
  return ToText(json);
}

std::string EvalAsCsv(const EvalReport& report) {
  std::string csv =
      CsvRow({"query", "method", "is_revisit", "has_match", "is_right", "score", "x", "y",
              "outcome", "is_pose_right", "error_m", "height_error_m", "yaw_error_deg", "missed"});
  for (const eval::MethodResult& result : report.results) {
    if (result.within_m != report.within_m) break;
    for (std::size_t i = 0; i < report.queries.size(); ++i) {
      const eval::ScoredQuery& scored = result.scored[i];
      const eval::MethodResult::Told& told = result.told[i];
      const PoseDifference off = told.error ? told.error->off : PoseDifference();
      const auto of_pose = [&](double value) { return told.error ? FixedText(value, 3) : ""; };
      csv += CsvRow({report.queries[i].name, result.name, scored.is_revisit ? "1" : "0",
                     scored.has_match ? "1" : "0", scored.is_right ? "1" : "0",
                     scored.has_match ? FixedText(scored.score, 6) : "",
                     scored.has_match ? FixedText(result.matched_m[i].x(), 3) : "",
                     scored.has_match ? FixedText(result.matched_m[i].y(), 3) : "",
                     OutcomeName(told.outcome), told.error && IsRight(*told.error) ? "1" : "0",
                     of_pose(off.plane_m), of_pose(off.height_m), of_pose(off.heading_deg),
                     told.error ? eval::MissText(MissOf(off)) : ""});
    }
  }
  return csv;
}

std::vector<std::string> EvalColumns() { return {kColumns.begin(), kColumns.end()}; }
std::vector<std::string> EvalRow(const eval::MethodResult& result) {
  std::optional<double> calibration_error, best_precision, best_recall;
  if (result.reliability) calibration_error = result.reliability->expected_calibration_error;
  if (const eval::OperatingPoint* best = BestPoint(result)) {
    best_precision = best->precision;
    best_recall = best->recall;
  }
  const eval::PrecisionRecall& curve = result.precision_recall;
  return {result.name,
          OrDash(Recall(result, 1), 3),
          OrDash(Recall(result, 5), 3),
          OrDash(Recall(result, 10), 3),
          OrDash(OfRevisits(result, curve.area), 3),
          OrDash(OfRevisits(result, curve.f1_max), 3),
          OrDash(best_precision, 3),
          OrDash(best_recall, 3),
          OrDash(OfRevisits(result, curve.recall_at_full_precision), 3),
          OrDash(OfRevisits(result, curve.extended_precision), 3),
          OrDash(result.divergence_at_f1_max, 3),
          OrDash(calibration_error, 3),
          OrDash(MedianOf(result.position_m), 2),
          OrDash(MedianOf(result.lateral_m), 2),
          OrDash(MedianOf(result.yaw_deg), 2),
          absl::StrFormat("%.2f", result.times.total_ms)};
}

std::vector<std::string> OutcomeRow(const eval::MethodResult& result) {
  const eval::OutcomeCounts& counts = result.outcomes;
  std::vector<std::string> row = {result.name};
  for (const std::size_t count :
       {counts.num_localized_right, counts.num_false, counts.num_false_plane,
        counts.num_false_height, counts.num_false_heading, counts.num_ambiguous,
        counts.num_not_recognized, counts.num_insufficient}) {
    row.push_back(result.tells_outcome ? absl::StrCat(count) : "-");
  }
  return row;
}

}  // namespace scanloc::report
