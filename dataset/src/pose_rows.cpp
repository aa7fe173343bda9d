#include "pose_rows.hpp"

#include <cstdint>
#include <optional>

#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::int64_t kMaxTextFileBytes = 512LL << 20;

// The values of a row: between commas if it has any, else between blanks.
void SplitRow(std::string_view row, Tokens& tokens) {
  if (row.find(',') == std::string_view::npos) return SplitAtBlanks(row, tokens);
  tokens.clear();
  Tokens words;
  for (bool more = true; more;) {
    const std::size_t comma = row.find(',');
    SplitAtBlanks(row.substr(0, comma), words);
    // Two words between commas are one bad value, and none is one too: both fail to parse.
    tokens.push_back(words.size() == 1 ? words[0] : row.substr(0, comma));
    more = comma != std::string_view::npos && tokens.size() < kMaxTokens;
    if (more) row.remove_prefix(comma + 1);
  }
}

}  // namespace

absl::Status ForEachRow(const std::string& file, BlankLines blank_lines, const RowHandler& handle) {
  const absl::StatusOr<FileBytes> bytes = ReadFileBytes(file, kMaxTextFileBytes);
  if (!bytes.ok()) return bytes.status();
  LineReader lines(bytes->view());
  Tokens tokens;
  std::size_t first_blank_line = 0;
  std::size_t num_rows = 0;
  while (const std::optional<std::string_view> line = lines.Next()) {
    SplitRow(*line, tokens);
    if (!tokens.empty() && !tokens[0].empty() && tokens[0][0] == '#') continue;
    if (tokens.empty()) {
      if (first_blank_line == 0 && blank_lines == BlankLines::kOnlyAtEnd) {
        first_blank_line = lines.line_number();
      }
      continue;
    }
    if (first_blank_line != 0) {
      // Rows are paired by their number: a row that went missing must not shift the others.
      return BadText(absl::StrCat(file, ":", first_blank_line, ": blank line between rows"));
    }
    if (static_cast<std::int64_t>(++num_rows) > limits::kMaxPlaces) {
      return BadText(absl::StrCat(file, ": more than ", limits::kMaxPlaces, " rows"));
    }
    if (absl::Status status = handle(tokens); !status.ok()) {
      return Annotate(status, absl::StrCat(file, ":", lines.line_number()));
    }
  }
  if (num_rows == 0) return BadText(absl::StrCat(file, ": holds no row"));
  return absl::OkStatus();
}

absl::Status CheckNumValues(const Tokens& row, std::size_t expected) {
  if (row.size() == expected) return absl::OkStatus();
  return BadText(absl::StrCat("has ", row.size(), " values; ", expected, " are needed"));
}

absl::StatusOr<Pose> ParseMatrix(std::span<const std::string_view> tokens) {
  const absl::StatusOr<std::array<double, 12>> values = ParseValues<12>(tokens);
  if (!values.ok()) return values.status();
  using RowMajor = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  return PoseFromMatrix(Eigen::Map<const RowMajor>(values->data()));
}

absl::StatusOr<Pose> PoseFromHomogeneous(const Eigen::Matrix4d& matrix) {
  constexpr double kRounding = 1e-3;
  const Eigen::Vector4d off = matrix.row(3).transpose() - Eigen::Vector4d::UnitW();
  if (!(off.array().abs() < kRounding).all()) {
    return BadText("the last row of the matrix is not 0 0 0 1");
  }
  return PoseFromMatrix(matrix.topRows<3>());
}

}  // namespace scanloc::dataset
