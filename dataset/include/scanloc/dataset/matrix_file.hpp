#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace scanloc::dataset {

using RowMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline constexpr std::int64_t kMaxMatrixFileBytes = 4LL << 30;
inline constexpr std::uint64_t kMaxMatrixColumns = 65'536;
/// Beyond it, distances of rows leave the range of float.
inline constexpr float kMaxMatrixValue = 1e15F;

/// Reads a NumPy array (.npy) of two dimensions of little-endian int16, int32, float32 or float64,
/// in either order, such as descriptors of scans, one a row.
///
/// NotFound: no such file. InvalidArgument, with the path and the reason: not a regular file,
/// larger than kMaxMatrixFileBytes, malformed, more or fewer values than its shape says, no row or
/// no column, more than limits::kMaxPlaces rows or kMaxMatrixColumns columns, or a value that is
/// not finite or beyond kMaxMatrixValue, with its row and column.
[[nodiscard]] absl::StatusOr<RowMatrix> ReadMatrix(const std::string& path);

/// Likewise from the bytes of such a file; errors without the path.
[[nodiscard]] absl::StatusOr<RowMatrix> DecodeNpyMatrix(std::string_view bytes);

}  // namespace scanloc::dataset
