#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::report {

/// One line of CSV with its line end (RFC 4180): fields with a comma, a quote or a line end are
/// quoted.
[[nodiscard]] std::string CsvRow(const std::vector<std::string>& fields);

/// A number with so many decimals; zero has no sign, so that equal answers are equal text.
[[nodiscard]] std::string FixedText(double value, int num_decimals);

/// Appends x y z [m] and qx qy qz qw (qw not negative), nine decimals each.
void AppendPoseFields(const Pose& pose, std::vector<std::string>* fields);

/// A CSV file in memory, read by the names of its columns.
class CsvTable {
 public:
  /// Takes both line ends, quoted fields and a byte order mark; blank lines are passed over.
  /// InvalidArgument, with the line: no header, a name twice, a row with another number of fields
  /// than the header, or a quote that does not end.
  [[nodiscard]] static absl::StatusOr<CsvTable> Parse(const std::string& text);

  [[nodiscard]] std::size_t num_rows() const { return rows_.size(); }
  [[nodiscard]] bool HasColumn(const std::string& column) const;

  /// The field's text. Requires row < num_rows() and HasColumn(column).
  [[nodiscard]] const std::string& Text(std::size_t row, const std::string& column) const;

  /// The field as a finite number; none where it is empty. InvalidArgument if it is neither.
  /// Requires row < num_rows() and HasColumn(column).
  [[nodiscard]] absl::StatusOr<std::optional<double>> Number(std::size_t row,
                                                             const std::string& column) const;

 private:
  std::map<std::string, std::size_t> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::size_t> lines_;  // of each row in the file, from 1
};

}  // namespace scanloc::report
