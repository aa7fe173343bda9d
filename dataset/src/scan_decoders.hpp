#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "text.hpp"

namespace scanloc::dataset {

/// The formats of ReadScan, from the bytes of a file. InvalidArgument without the path.
[[nodiscard]] absl::StatusOr<Scan> DecodeKittiBin(std::string_view bytes);
[[nodiscard]] absl::StatusOr<Scan> DecodePcd(std::string_view bytes);
[[nodiscard]] absl::StatusOr<Scan> DecodePly(std::string_view bytes);
[[nodiscard]] absl::StatusOr<Scan> DecodeNcltSync(std::string_view bytes);
/// NumPy arrays of NAVER LABS.
[[nodiscard]] absl::StatusOr<Scan> DecodeNpy(std::string_view bytes);
/// Of one of the two sensors, in the frame of both together.
[[nodiscard]] absl::StatusOr<Scan> DecodeOxford(std::string_view bytes, bool is_left);

/// Whether a coordinate is beyond limits::kMaxCoordinate_m.
[[nodiscard]] inline bool IsBeyondLimit(const Point& p) {
  return std::abs(p.x) > limits::kMaxCoordinate_m || std::abs(p.y) > limits::kMaxCoordinate_m ||
         std::abs(p.z) > limits::kMaxCoordinate_m;
}

/// Where x, y and z stand in a row of text.
struct RowLayout {
  std::size_t num_columns = 0;
  std::array<std::size_t, 3> xyz{};
};

/// Reads the next num_rows rows that are not blank.
[[nodiscard]] absl::StatusOr<Scan> ReadTextRows(const RowLayout& layout, std::size_t num_rows,
                                                LineReader& lines);

enum class NumberType { kFloat32, kFloat64, kInt16, kInt32 };

[[nodiscard]] constexpr NumberType FloatOf(std::size_t size_bytes) {
  return size_bytes == 8 ? NumberType::kFloat64 : NumberType::kFloat32;
}

/// Where the values of one coordinate lie in a block of bytes.
struct Coordinate {
  std::size_t offset_bytes = 0;  ///< of the first point's value
  std::size_t stride_bytes = 0;  ///< from one point's value to the next
  NumberType type = NumberType::kFloat32;
};

struct BinaryLayout {
  std::array<Coordinate, 3> xyz{};
  bool big_endian = false;
};

/// Reads num_points points. Requires all their values to lie within bytes.
[[nodiscard]] Scan ReadBinary(const BinaryLayout& layout, std::size_t num_points,
                              std::string_view bytes);

}  // namespace scanloc::dataset
