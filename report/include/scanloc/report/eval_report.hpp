#pragma once

#include <string>
#include <vector>

#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/eval/evaluation.hpp"
#include "scanloc/report/map_picture.hpp"

namespace scanloc::report {

/// How a report came to be; empty where nobody says.
struct Provenance {
  std::string version;
  std::string command;  ///< with its arguments
  std::string date;     ///< ISO 8601, UTC
};

/// What the texts below tell of.
struct EvalReport {
  Provenance made = {};
  std::string map;  ///< file
  std::string content_id;
  SensorMount mount;      ///< of the sensor that saw the queries
  double within_m = 8.0;  ///< the first of those that are asked for; curves are of this one
  std::vector<eval::EvalQuery> queries;
  std::vector<eval::MethodResult>
      results;                        ///< those of the first within_m, then those of the others
  std::vector<PicturedPlace> places;  ///< of the map
};

/// The columns of the table, and a method's row.
[[nodiscard]] std::vector<std::string> EvalColumns();
[[nodiscard]] std::vector<std::string> EvalRow(const eval::MethodResult& result);

/// The method's name and its answers by outcome and by what is right of their pose; "-" for a
/// method that tells no outcome.
[[nodiscard]] std::vector<std::string> OutcomeRow(const eval::MethodResult& result);

/// Of the revisits of one kind.
struct KindCount {
  std::size_t num_revisits = 0;
  std::size_t num_right = 0;  ///< by the first candidate, accepted or not
};
[[nodiscard]] KindCount CountKind(const EvalReport& report, const eval::MethodResult& result,
                                  std::size_t kind);

/// One line: how many queries of which kind.
[[nodiscard]] std::string EvalSummary(const EvalReport& report);
/// A table for people; with_times: and one of the stages' times.
[[nodiscard]] std::string EvalAsTable(const EvalReport& report, bool with_times = false);
/// One JSON document: counts, measures and curves of every method.
[[nodiscard]] std::string EvalAsJson(const EvalReport& report);
/// One HTML page that needs no other file: tables, curves, distribution of revisits, matches.
[[nodiscard]] std::string EvalAsHtml(const EvalReport& report);
/// One row a query and method: query, method, is_revisit, has_match, is_right, score.
[[nodiscard]] std::string EvalAsCsv(const EvalReport& report);

}  // namespace scanloc::report
