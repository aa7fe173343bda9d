#include "pose_rows.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "file_bytes.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::int64_t kMaxTextFileBytes = 512LL << 20;

void SplitAt(char separator, std::string_view row, Tokens& tokens) {
  tokens.clear();
  Tokens words;
  for (bool more = true; more;) {
    const std::size_t end = row.find(separator);
    SplitAtBlanks(row.substr(0, end), words);
    // Two words in between are one bad value, and none is one too: both fail to parse.
    tokens.push_back(words.size() == 1 ? words[0] : row.substr(0, end));
    more = end != std::string_view::npos && tokens.size() < kMaxTokens;
    if (more) row.remove_prefix(end + 1);
  }
  const bool ends_with_one = tokens.back().find_first_not_of(" \t\r") == std::string_view::npos;
  if (ends_with_one) tokens.pop_back();
}

// As much of the world writes 0,5: a number with a comma in it, and others that do not hang on it.
bool IsDecimalWithComma(std::string_view token) {
  const std::size_t comma = token.find(',');
  if (comma == std::string_view::npos) return false;
  std::string with_point(token);
  with_point[comma] = '.';
  double value = 0.0;
  return absl::SimpleAtod(with_point, &value);
}

absl::Status SplitRow(std::string_view line, TextRow& row) {
  const auto has = [&](char c) { return line.find(c) != std::string_view::npos; };
  row.has_commas = has(',') && !has(';');
  has(';') ? SplitAt(';', line, row.values) : SplitAtBlanks(line, row.values);
  if (!has(',')) return absl::OkStatus();
  if (row.values.size() > 1 && std::ranges::all_of(row.values, &IsDecimalWithComma)) {
    return Invalid(
        absl::StrCat(Quote(row.values[0]), " has a comma for a point; write 0.5, not 0,5"));
  }
  if (row.has_commas) SplitAt(',', line, row.values);
  return absl::OkStatus();
}

}  // namespace

absl::Status ForEachRow(const std::string& file, BlankLines blank_lines, const RowHandler& handle,
                        const RowHandler& handle_comment) {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(file, kMaxTextFileBytes));
  const std::string_view mark = bytes.view().substr(0, 2);
  if (mark == "\xFF\xFE" || mark == "\xFE\xFF") {
    return Invalid(absl::StrCat(file, ": is text in UTF-16; save it as UTF-8"));
  }
  LineReader lines(bytes.view());
  TextRow row;
  std::size_t first_blank_line = 0;
  std::size_t num_rows = 0;
  while (std::optional<std::string_view> line = lines.Next()) {
    const std::size_t begin = std::min(line->find_first_not_of(" \t"), line->size());
    const bool is_comment = line->substr(begin, 1) == "#";
    if (is_comment && !handle_comment) continue;
    row.line = lines.line_number();
    if (absl::Status status = SplitRow(is_comment ? line->substr(begin + 1) : *line, row);
        !status.ok() && !is_comment) {
      return Annotate(status, absl::StrCat(file, ":", row.line));
    }
    if (row.values.empty()) {
      if (first_blank_line == 0 && blank_lines == BlankLines::kOnlyAtEnd && !is_comment) {
        first_blank_line = row.line;
      }
      continue;
    }
    if (first_blank_line != 0 && !is_comment) {
      // Rows are paired by their number: a row that went missing must not shift the others.
      return Invalid(absl::StrCat(file, ":", first_blank_line, ": blank line between rows"));
    }
    if (!is_comment && static_cast<std::int64_t>(++num_rows) > limits::kMaxPlaces) {
      return Invalid(absl::StrCat(file, ": more than ", limits::kMaxPlaces, " rows"));
    }
    if (absl::Status status = (is_comment ? handle_comment : handle)(row); !status.ok()) {
      return Annotate(status, absl::StrCat(file, ":", row.line));
    }
  }
  if (num_rows == 0) return Invalid(absl::StrCat(file, ": holds no row"));
  return absl::OkStatus();
}

absl::Status CheckNumValues(const Tokens& row, std::size_t expected) {
  if (row.size() == expected) return absl::OkStatus();
  return Invalid(absl::StrCat("has ", row.size(), " values; ", expected, " are needed"));
}

absl::StatusOr<Pose> ParseMatrix(std::span<const std::string_view> tokens) {
  ASSIGN_OR_RETURN(const auto values, ParseValues<12>(tokens));
  using RowMajor = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  return PoseFromMatrix(Eigen::Map<const RowMajor>(values.data()));
}

absl::StatusOr<Pose> PoseFromHomogeneous(const Eigen::Matrix4d& matrix) {
  constexpr double kRounding = 1e-3;
  const Eigen::Vector4d off = matrix.row(3).transpose() - Eigen::Vector4d::UnitW();
  if (!(off.array().abs() < kRounding).all()) {
    return Invalid("the last row of the matrix is not 0 0 0 1");
  }
  return PoseFromMatrix(matrix.topRows<3>());
}

}  // namespace scanloc::dataset
