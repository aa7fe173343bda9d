#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>

#include "absl/status/statusor.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "text.hpp"

namespace scanloc::dataset {

/// The formats of ReadScan, from the bytes of a file, with intensities if asked and there are some.
/// InvalidArgument without the path.
[[nodiscard]] absl::StatusOr<Scan> DecodeKittiBin(std::string_view bytes, bool with_intensities);
[[nodiscard]] absl::StatusOr<Scan> DecodePcd(std::string_view bytes, bool with_intensities);
[[nodiscard]] absl::StatusOr<Scan> DecodePly(std::string_view bytes, bool with_intensities);
[[nodiscard]] absl::StatusOr<Scan> DecodeNcltSync(std::string_view bytes, bool with_intensities);
/// NumPy arrays of NAVER LABS, which have no intensities.
[[nodiscard]] absl::StatusOr<Scan> DecodeNpy(std::string_view bytes, bool with_intensities);
/// Of one of the two sensors, in the frame of both together.
[[nodiscard]] absl::StatusOr<Scan> DecodeOxford(std::string_view bytes, bool is_left,
                                                bool with_intensities);

/// Whether a coordinate is beyond limits::kMaxCoordinate_m.
[[nodiscard]] inline bool IsBeyondLimit(const Point& p) {
  return std::abs(p.x) > limits::kMaxCoordinate_m || std::abs(p.y) > limits::kMaxCoordinate_m ||
         std::abs(p.z) > limits::kMaxCoordinate_m;
}

/// Whether a field or property of this name holds intensities.
[[nodiscard]] inline bool IsIntensity(std::string_view name) {
  return name == "intensity" || name == "reflectivity" || name == "reflectance";
}

/// Where x, y and z stand in a row of text.
struct RowLayout {
  std::size_t num_columns = 0;
  std::array<std::size_t, 3> xyz{};
  std::optional<std::size_t> intensity = {};  ///< if it is to be read
};

/// Reads the next num_rows rows that are not blank.
[[nodiscard]] absl::StatusOr<Scan> ReadTextRows(const RowLayout& layout, std::size_t num_rows,
                                                LineReader& lines);

enum class NumberType { kFloat32, kFloat64, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32 };

[[nodiscard]] constexpr NumberType FloatOf(std::size_t size_bytes) {
  return size_bytes == 8 ? NumberType::kFloat64 : NumberType::kFloat32;
}
/// None: whole numbers of that size are not read.
[[nodiscard]] constexpr std::optional<NumberType> WholeOf(std::size_t size_bytes, bool is_signed) {
  if (size_bytes == 1) return is_signed ? NumberType::kInt8 : NumberType::kUint8;
  if (size_bytes == 2) return is_signed ? NumberType::kInt16 : NumberType::kUint16;
  if (size_bytes == 4) return is_signed ? NumberType::kInt32 : NumberType::kUint32;
  return std::nullopt;
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
  std::optional<Coordinate> intensity = {};  ///< if it is to be read
};

/// Reads num_points points. Requires all their values to lie within bytes.
[[nodiscard]] Scan ReadBinary(const BinaryLayout& layout, std::size_t num_points,
                              std::string_view bytes);

}  // namespace scanloc::dataset
