#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc::dataset {

/// One scan as its file gives it, in the file's order and frame [m].
struct Scan {
  PointCloud points;               ///< all finite
  std::size_t num_not_finite = 0;  ///< points of the file left out: a coordinate is NaN or infinite
  std::size_t num_no_return = 0;   ///< .npy: rows of zeros left out, beams without a return
  /// One a point where ReadScanWithIntensities read it, else none. In the unit of the file; what is
  /// negative or not finite is 0.
  std::vector<float> intensities = {};

  friend bool operator==(const Scan&, const Scan&) = default;
};

/// How the bytes of a scan file are laid out.
enum class ScanLayout {
  kByExtension,  ///< as ReadScan(path) says
  kNclt,         ///< NCLT velodyne_sync
  kOxford,       ///< Oxford Radar RobotCar, velodyne_left and velodyne_right
};

/// Scans that are no files of their own, such as those of a bag. Any number of threads may read.
class ScanStore {
 public:
  virtual ~ScanStore() = default;
  [[nodiscard]] virtual absl::StatusOr<Scan> Read(std::size_t index,
                                                  bool with_intensities) const = 0;
};

/// A scan of a drive: a file, or one of a store.
struct ScanFile {
  std::string path;
  std::string name;  ///< the file's name without its folder; of a store: its stamp
  ScanLayout layout = ScanLayout::kByExtension;
  std::string partner_path = {};  ///< kOxford: the scan of the right sensor
  std::shared_ptr<const ScanStore> store = {};
  std::size_t index = 0;  ///< in the store

  friend bool operator==(const ScanFile&, const ScanFile&) = default;
};

/// When a scan was taken, if its name gives it: 19 digits [ns] or 16 digits [µs].
[[nodiscard]] std::optional<std::int64_t> StampOfName(std::string_view name);

/// Whether ReadScan knows the file's extension: .bin, .npy, .pcd or .ply, in either case.
[[nodiscard]] bool IsScanFile(std::string_view path);

/// Reads one scan, by its extension:
///   .bin  KITTI: float32 x y z intensity, little endian, without a header; nuScenes: and the
///         number of a ray, a whole number up to 255, after it;
///   .pcd  ascii, binary or binary_compressed, with fields x y z of type F;
///   .ply  ascii, binary_little_endian or binary_big_endian, with float or double x y z;
///   .npy  NAVER LABS: a NumPy array of a row a point, whose first three columns are x y z in
///         CENTIMETRES, of little-endian int16, int32, float32 or float64.
///
/// NotFound: no such file. InvalidArgument, with the path and the reason: not a regular file,
/// empty, truncated, larger than limits::kMaxScanFileBytes, more than limits::kMaxPointsPerScan
/// points, malformed, or coordinates that no LiDAR gives (a file of another layout).
/// ResourceExhausted: out of memory. Any number of threads may read at once.
[[nodiscard]] absl::StatusOr<Scan> ReadScan(const std::string& path);

/// Reads one scan from a stream to its end: .pcd, .ply and .npy by how they begin, else KITTI's
/// .bin. Errors as above, with the name in place of a path.
[[nodiscard]] absl::StatusOr<Scan> ReadScan(std::FILE* stream, const std::string& name);

/// Reads one scan from bytes: by the name's extension if it has one of those above, else by how
/// they begin. Errors likewise.
[[nodiscard]] absl::StatusOr<Scan> ReadScanBytes(std::string_view bytes, const std::string& name);

/// Likewise, by its layout:
///   kNclt    rows of three uint16, little endian, in steps of 5 mm from -100 m, and two bytes
///            more: x forward, y right, z down of the robot, whose origin is near the ground. Given
///            as x forward, y left, z up of a sensor 0.957 m above it (the HDL-32E's mount);
///   kOxford  float32, little endian: all x, all y, all z, all intensities; both sensors' scans in
///            one, as x forward, y left, z up of a sensor in the middle of the two, with the axes
///            of the INS, which stands level in the vehicle.
/// InvalidArgument also if either of the two files of kOxford is bad.
[[nodiscard]] absl::StatusOr<Scan> ReadScan(const ScanFile& file);

/// The same with intensities: the fourth value of .bin, field or property "intensity",
/// "reflectivity" or "reflectance" of .pcd, .ply and PointCloud2, of any type of number.
/// InvalidArgument too if the scan has points and no such field; .npy has none.
[[nodiscard]] absl::StatusOr<Scan> ReadScanWithIntensities(const ScanFile& file);

}  // namespace scanloc::dataset
