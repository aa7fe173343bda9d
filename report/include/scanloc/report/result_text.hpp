#pragma once

#include <string>
#include <vector>

#include "scanloc/core/prior.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/report/query_result.hpp"

namespace scanloc::report {

/// What the texts below say beside the documented columns.
struct ResultFormat {
  bool several_maps = false;    ///< candidates tell the map that they are in
  bool geo = false;             ///< where candidates are on earth: a map that is asked knows it
  bool all_candidates = false;  ///< CSV: a row a candidate, with its rank from 1, not only the best
  bool truth = false;           ///< errors and true positions
  bool sequence = false;        ///< how many scans the answers rest on
  double within_m = 8.0;        ///< as in Summary
  SensorMount mount = {};       ///< JSON: how the queries' sensor sits on its robot
  Prior prior = {};             ///< JSON: where they were looked for
};

/// A row a query, in order: the columns of docs and help, then `rank`, those of the truth and those
/// of a sequence as the format asks. Equal answers give equal bytes.
[[nodiscard]] std::string ResultsAsCsv(const std::vector<QueryResult>& results,
                                       const ResultFormat& format);

/// One document with all candidates. Equal answers give equal bytes: it holds no times.
[[nodiscard]] std::string ResultsAsJson(const std::vector<QueryResult>& results,
                                        const std::string& method, const ResultFormat& format);

/// Aligned columns for a person.
[[nodiscard]] std::string ResultsAsTable(const std::vector<QueryResult>& results,
                                         const ResultFormat& format);

/// Counts, errors and times of all queries, for a person.
[[nodiscard]] std::string SummaryText(const std::vector<QueryResult>& results,
                                      const ResultFormat& format);

}  // namespace scanloc::report
