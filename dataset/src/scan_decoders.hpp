#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "scanloc/dataset/scan_reader.hpp"
#include "text.hpp"

namespace scanloc::dataset {

/// The formats of ReadScan, from the bytes of a file. InvalidArgument without the path.
[[nodiscard]] absl::StatusOr<Scan> DecodeKittiBin(std::string_view bytes);
[[nodiscard]] absl::StatusOr<Scan> DecodePcd(std::string_view bytes);
[[nodiscard]] absl::StatusOr<Scan> DecodePly(std::string_view bytes);

/// Appends a point, or counts it if it is not finite.
inline void AddPoint(const Point& point, Scan& scan) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z)) {
    scan.points.push_back(point);
  } else {
    ++scan.num_not_finite;
  }
}

/// Where x, y and z stand in a row of text.
struct RowLayout {
  std::size_t num_columns = 0;
  std::array<std::size_t, 3> xyz{};
};

/// Reads the next num_rows rows that are not blank.
[[nodiscard]] absl::StatusOr<Scan> ReadTextRows(const RowLayout& layout, std::size_t num_rows,
                                                LineReader& lines);

/// How a record stores a coordinate.
struct Coordinate {
  std::size_t offset_bytes = 0;
  bool is_double = false;  ///< else float
};

/// Binary records of equal size that hold x, y and z.
struct RecordLayout {
  std::size_t record_bytes = 0;
  std::array<Coordinate, 3> xyz{};
  bool big_endian = false;
};

/// Reads num_records records. Requires bytes.size() >= num_records * layout.record_bytes.
[[nodiscard]] Scan ReadRecords(const RecordLayout& layout, std::size_t num_records,
                               std::string_view bytes);

}  // namespace scanloc::dataset
