#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "scanloc/core/point_cloud.hpp"

namespace scanloc::dataset {

/// One scan as its file gives it, in the file's order and frame [m].
struct Scan {
  PointCloud points;               ///< all finite
  std::size_t num_not_finite = 0;  ///< points of the file left out: a coordinate is NaN or infinite

  friend bool operator==(const Scan&, const Scan&) = default;
};

/// Whether ReadScan knows the file's extension: .bin, .pcd or .ply, in either case.
[[nodiscard]] bool IsScanFile(std::string_view path);

/// Reads one scan, by its extension:
///   .bin  KITTI: float32 x y z intensity, little endian, without a header;
///   .pcd  ascii, binary or binary_compressed, with fields x y z of type F;
///   .ply  ascii, binary_little_endian or binary_big_endian, with float or double x y z.
///
/// NotFound: no such file. InvalidArgument, with the path and the reason: not a regular file,
/// empty, truncated, larger than limits::kMaxScanFileBytes, more than limits::kMaxPointsPerScan
/// points, malformed, or coordinates that no LiDAR gives (a file of another layout).
/// ResourceExhausted: out of memory. Any number of threads may read at once.
[[nodiscard]] absl::StatusOr<Scan> ReadScan(const std::string& path);

}  // namespace scanloc::dataset
