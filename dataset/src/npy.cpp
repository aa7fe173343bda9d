#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "npy_header.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::uint64_t kMaxColumns = 1024;

absl::Status CheckShape(const NpyHeader& header, std::size_t num_bytes) {
  if (header.num_columns < 3 || header.num_columns > kMaxColumns) {
    return BadNpy(absl::StrCat("it has ", header.num_columns,
                               " columns; x, y and z are needed, and ", kMaxColumns, " at most"));
  }
  if (header.num_rows > limits::kMaxPointsPerScan) {
    return BadNpy(absl::StrCat("it holds ", header.num_rows, " points; a scan has at most ",
                               limits::kMaxPointsPerScan));
  }
  return CheckNpySize(header, num_bytes);
}

BinaryLayout LayoutOf(const NpyHeader& header) {
  const std::size_t size = header.value_bytes;
  BinaryLayout layout;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.xyz[axis] = header.fortran_order
                           ? Coordinate{header.num_rows * axis * size, size, header.type}
                           : Coordinate{axis * size, header.num_columns * size, header.type};
  }
  return layout;
}

// Metres taken for centimetres put all points next to the sensor.
absl::Status CheckCentimetres(const Scan& scan) {
  constexpr float kNear_m = 1.0F;
  const auto num_near = static_cast<std::size_t>(std::ranges::count_if(
      scan.points, [](const Point& p) { return std::hypot(p.x, p.y, p.z) < kNear_m; }));
  if (num_near <= scan.points.size() / 2) return absl::OkStatus();
  return BadNpy(
      absl::StrCat(num_near, " of its ", scan.points.size(), " points lie within ", kNear_m,
                   " m of the sensor: .npy scans are read as NAVER LABS's, in centimetres, "
                   "and this one seems to be in metres"));
}

}  // namespace

absl::StatusOr<Scan> DecodeNpy(std::string_view bytes, bool /*with_intensities*/) {
  ASSIGN_OR_RETURN(const NpyHeader header, TakeNpyHeader(bytes));
  RETURN_IF_ERROR(CheckShape(header, bytes.size()));
  Scan scan = ReadBinary(LayoutOf(header), header.num_rows, bytes);
  scan.num_no_return = static_cast<std::size_t>(std::erase(scan.points, Point{}));
  constexpr float kCmPerM = 100.0F;
  for (Point& p : scan.points) p = {p.x / kCmPerM, p.y / kCmPerM, p.z / kCmPerM};
  RETURN_IF_ERROR(CheckCentimetres(scan));
  return scan;
}

}  // namespace scanloc::dataset
