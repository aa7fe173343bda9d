#include "scanloc/dataset/matrix_file.hpp"

#include <bit>
#include <cmath>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "npy_header.hpp"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

double ValueAt(const NpyHeader& header, const char* bytes) {
  switch (header.type) {
    case NumberType::kInt16:
      return LoadNumber<std::int16_t>(bytes, std::endian::little);
    case NumberType::kInt32:
      return LoadNumber<std::int32_t>(bytes, std::endian::little);
    case NumberType::kFloat32:
      return LoadNumber<float>(bytes, std::endian::little);
    default:  // TakeNpyHeader knows these four
      return LoadNumber<double>(bytes, std::endian::little);
  }
}

absl::Status CheckMatrix(const NpyHeader& header, std::size_t num_bytes) {
  if (header.num_rows < 1 || header.num_rows > std::uint64_t{limits::kMaxPlaces}) {
    return BadNpy(
        absl::StrCat("it has ", header.num_rows, " rows; 1 to ", limits::kMaxPlaces, " are read"));
  }
  if (header.num_columns < 1 || header.num_columns > kMaxMatrixColumns) {
    return BadNpy(absl::StrCat("it has ", header.num_columns, " columns; 1 to ", kMaxMatrixColumns,
                               " are read"));
  }
  RETURN_IF_ERROR(CheckNpySize(header, num_bytes));
  const std::uint64_t used = header.num_rows * header.num_columns * header.value_bytes;
  if (used == num_bytes) return absl::OkStatus();
  return BadNpy(absl::StrCat(num_bytes - used, " bytes follow the values that its shape says"));
}

}  // namespace

absl::StatusOr<RowMatrix> DecodeNpyMatrix(std::string_view bytes) {
  ASSIGN_OR_RETURN(const NpyHeader header, TakeNpyHeader(bytes));
  RETURN_IF_ERROR(CheckMatrix(header, bytes.size()));
  RowMatrix matrix(static_cast<Eigen::Index>(header.num_rows),
                   static_cast<Eigen::Index>(header.num_columns));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      const Eigen::Index at =
          header.fortran_order ? column * matrix.rows() + row : row * matrix.cols() + column;
      const double value =
          ValueAt(header, bytes.data() + static_cast<std::size_t>(at) * header.value_bytes);
      if (!(std::abs(value) <= kMaxMatrixValue)) {
        return BadNpy(absl::StrCat("its value in row ", row, ", column ", column, " is ", value,
                                   "; values must be finite and within ±", kMaxMatrixValue));
      }
      matrix(row, column) = static_cast<float>(value);
    }
  }
  return matrix;
}

absl::StatusOr<RowMatrix> ReadMatrix(const std::string& path) {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(path, kMaxMatrixFileBytes));
  absl::StatusOr<RowMatrix> matrix = DecodeNpyMatrix(bytes.view());
  if (!matrix.ok()) return Annotate(matrix.status(), path);
  return matrix;
}

}  // namespace scanloc::dataset
