#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "scanloc/report/eval_report.hpp"

namespace scanloc::report {

using QueriesByKind = std::array<std::vector<std::size_t>, eval::kNumKinds>;

/// What became of the queries at one threshold; numbers of queries.
struct SortedQueries {
  QueriesByKind right;
  QueriesByKind missed;  ///< revisits without an accepted match
  std::vector<std::size_t> wrong;
  std::size_t num_wrong_elsewhere = 0;  ///< of queries whose position in the map is not known
};
/// No threshold accepts nothing.
[[nodiscard]] SortedQueries SortQueries(const EvalReport& report, const eval::MethodResult& result,
                                        std::optional<double> threshold);

[[nodiscard]] std::size_t CountAll(const QueriesByKind& kinds);

[[nodiscard]] std::optional<double> ThresholdAtF1Max(const eval::MethodResult& result);
/// The least one at which no accepted match is wrong.
[[nodiscard]] std::optional<double> ThresholdAtFullPrecision(const eval::MethodResult& result);

}  // namespace scanloc::report
