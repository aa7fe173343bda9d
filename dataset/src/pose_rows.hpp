#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/scan/pose.hpp"
#include "text.hpp"

/// Rows of numbers in text files of poses, times and calibrations.
namespace scanloc::dataset {

/// A row of a text file.
struct TextRow {
  Tokens values;
  bool has_commas = false;  ///< the values stand between commas
  std::size_t line = 0;     ///< its number in the file
};
using RowHandler = std::function<absl::Status(const TextRow& row)>;

enum class BlankLines { kSkip, kOnlyAtEnd };

/// Calls `handle` for each row of a file that is no comment, and `handle_comment`, if there is one,
/// for those that are, without their "#"; a status that they return gets file and line. The values
/// of a row stand between semicolons if it has any, else between commas, else between blanks; one
/// at its end is ignored. InvalidArgument if decimals have a comma for a point.
[[nodiscard]] absl::Status ForEachRow(const std::string& file, BlankLines blank_lines,
                                      const RowHandler& handle,
                                      const RowHandler& handle_comment = nullptr);

/// InvalidArgument if the row has another number of values.
[[nodiscard]] absl::Status CheckNumValues(const Tokens& row, std::size_t expected);

/// The tokens as numbers. Requires kNum of them.
template <std::size_t kNum>
[[nodiscard]] absl::StatusOr<std::array<double, kNum>> ParseValues(
    std::span<const std::string_view> tokens) {
  std::array<double, kNum> values{};
  for (std::size_t i = 0; i < kNum; ++i) {
    if (!absl::SimpleAtod(ToAbsl(tokens[i]), &values[i])) {
      return Invalid(absl::StrCat(Quote(tokens[i]), " is not a number"));
    }
  }
  return values;
}

/// Twelve tokens as [R t], row by row.
[[nodiscard]] absl::StatusOr<Pose> ParseMatrix(std::span<const std::string_view> tokens);

/// The pose of a 4x4 matrix. InvalidArgument too if its last row is not 0 0 0 1.
[[nodiscard]] absl::StatusOr<Pose> PoseFromHomogeneous(const Eigen::Matrix4d& matrix);

}  // namespace scanloc::dataset
