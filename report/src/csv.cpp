#include "scanloc/report/csv.hpp"

#include <cmath>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::report {
namespace {

/// Splits CSV text into rows, one call a row.
class RowReader {
 public:
  explicit RowReader(const std::string& text) : text_(text) {
    if (absl::StartsWith(text_, "\xEF\xBB\xBF")) at_ = 3;
  }

  [[nodiscard]] bool AtEnd() const { return at_ >= text_.size(); }
  [[nodiscard]] std::size_t line() const { return line_; }

  [[nodiscard]] absl::StatusOr<std::vector<std::string>> Next() {
    std::vector<std::string> fields;
    for (;;) {
      ASSIGN_OR_RETURN(std::string field, NextField());
      fields.push_back(std::move(field));
      if (AtEnd() || text_[at_++] == '\n') break;  // else it was a comma
    }
    ++line_;
    return fields;
  }

 private:
  // Leaves at_ on the comma or line feed behind the field, or at the end.
  [[nodiscard]] absl::StatusOr<std::string> NextField() {
    std::string field;
    const std::size_t first_line = line_;
    bool quoted = false;
    if (!AtEnd() && text_[at_] == '"') {
      quoted = true;
      ++at_;
    }
    for (; !AtEnd(); ++at_) {
      const char c = text_[at_];
      if (!quoted && (c == ',' || c == '\n')) break;
      if (quoted && c == '"') {
        if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
          ++at_;
        } else {
          quoted = false;
          continue;
        }
      }
      if (c == '\n') ++line_;
      field += c;
    }
    if (quoted) {
      return absl::InvalidArgumentError(
          absl::StrCat("line ", first_line, ": a quoted field does not end"));
    }
    const bool at_row_end = AtEnd() || text_[at_] == '\n';
    if (at_row_end && !field.empty() && field.back() == '\r') field.pop_back();
    return field;
  }

  const std::string& text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

}  // namespace

std::string CsvRow(const std::vector<std::string>& fields) {
  std::string row;
  for (const std::string& raw : fields) {
    if (&raw != &fields.front()) row += ',';
    const std::string field = Printable(raw);
    if (field.find_first_of(",\"") == std::string::npos) {
      row += field;
      continue;
    }
    row += '"';
    for (const char c : field) {
      if (c == '"') row += '"';
      row += c;
    }
    row += '"';
  }
  return row + "\n";
}

std::string FixedText(double value, int num_decimals) {
  std::string text = absl::StrFormat("%.*f", num_decimals, value);
  if (text.front() == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  return text;
}

void AppendPoseFields(const Pose& pose, std::vector<std::string>* fields) {
  constexpr int kDecimals = 9;
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const Eigen::Vector3d& t = pose.translation();
  for (const double number : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    fields->push_back(FixedText(number, kDecimals));
  }
}

absl::StatusOr<CsvTable> CsvTable::Parse(const std::string& text) {
  RowReader reader(text);
  if (reader.AtEnd()) return absl::InvalidArgumentError("the file is empty");
  ASSIGN_OR_RETURN(const std::vector<std::string> header, reader.Next());
  CsvTable table;
  for (const std::string& name : header) {
    if (!table.columns_.emplace(name, table.columns_.size()).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("line 1: the column \"", name, "\" is there twice"));
    }
  }
  while (!reader.AtEnd()) {
    const std::size_t line = reader.line();
    ASSIGN_OR_RETURN(std::vector<std::string> fields, reader.Next());
    if (fields.size() == 1 && fields.front().empty()) continue;
    if (fields.size() != header.size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "line ", line, ": ", fields.size(), " fields, but the header has ", header.size()));
    }
    table.rows_.push_back(std::move(fields));
    table.lines_.push_back(line);
  }
  return table;
}

bool CsvTable::HasColumn(const std::string& column) const { return columns_.count(column) > 0; }

const std::string& CsvTable::Text(std::size_t row, const std::string& column) const {
  return rows_[row][columns_.at(column)];
}

absl::StatusOr<std::optional<double>> CsvTable::Number(std::size_t row,
                                                       const std::string& column) const {
  const std::string& text = Text(row, column);
  if (text.empty()) return std::nullopt;
  double value = 0.0;
  if (absl::SimpleAtod(text, &value) && std::isfinite(value)) return value;
  return absl::InvalidArgumentError(absl::StrCat("line ", lines_[row], ": ", column, " is \"",
                                                 text.substr(0, 40), "\", which is no number"));
}

}  // namespace scanloc::report
