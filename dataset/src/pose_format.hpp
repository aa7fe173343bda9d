#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "pose_rows.hpp"
#include "scanloc/dataset/pose_reader.hpp"

/// Telling the format of a file of poses.
namespace scanloc::dataset {

/// Whether a token is a whole number of min_digits to max_digits digits.
[[nodiscard]] bool IsWhole(std::string_view token, std::size_t min_digits, std::size_t max_digits);

/// Values in a row of this format; 0 where rows differ.
[[nodiscard]] std::size_t NumValues(PoseFormat format);

/// The format of a file by its first row of numbers. Where several formats have rows of this
/// length, what is typical of one is demanded: MulRan's and NCLT's stamps of 19 and 16 digits
/// between commas, NAVER LABS's calibration.json. InvalidArgument if it cannot be told.
[[nodiscard]] absl::StatusOr<PoseFormat> DetectFormat(const TextRow& first_row,
                                                      bool has_naver_calib);

/// Whether a row is the headline of a table: it holds no number.
[[nodiscard]] bool IsHeadline(const Tokens& row);

}  // namespace scanloc::dataset
