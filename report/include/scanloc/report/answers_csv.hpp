#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::report {

/// What a picture needs of one query in the CSV of `scanloc locate`.
struct CsvAnswer {
  std::string query;
  std::string outcome;
  std::optional<std::size_t> place;         ///< index in the map
  std::optional<Eigen::Vector2d> answered;  ///< x and y of T_map_query [m]
  std::optional<Eigen::Vector2d> truth;     ///< true_x and true_y [m], where the CSV has them
  std::optional<bool> is_right;             ///< nothing is missed, where the CSV says what is
};

/// Reads the CSV's best answers (rank 1 where it has ranks), in its order.
///
/// NotFound: no such file. InvalidArgument, with path and line: not CSV, a column missing, or a
/// field that is no number.
[[nodiscard]] absl::StatusOr<std::vector<CsvAnswer>> ReadAnswersCsv(const std::string& path);

}  // namespace scanloc::report
