#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc {

/// What became of the points of one scan.
struct ScanCounts {
  std::size_t num_points = 0;        ///< given
  std::size_t num_not_finite = 0;    ///< skipped: NaN or infinite
  std::size_t num_beyond_limit = 0;  ///< skipped: a coordinate beyond limits::kMaxCoordinate_m
  std::size_t num_voxels = 0;        ///< occupied voxels, so points left
  std::size_t num_masked = 0;        ///< left out before these were given: see SensorMount

  friend bool operator==(const ScanCounts&, const ScanCounts&) = default;
};

struct VoxelRun;

/// Thins a scan to one point a voxel, the centroid of the points in it (paper, tab:impl).
///
/// Voxels are half-open cubes and mirror images of each other about zero: along x, the i-th on
/// either side of zero holds i <= |x| / voxel_size_m < i + 1. Points that are not finite are
/// skipped and counted. The centroids come in the order in which the voxels were first hit, so the
/// same scan always gives the same bits.
///
/// Keeps its tables from scan to scan; use one per thread. O(points), one pass.
class VoxelFilter {
 public:
  /// Requires voxel_size_m in [0.05, 10].
  explicit VoxelFilter(double voxel_size_m);

  /// The centroids of the scan's voxels; valid until the next call.
  /// counts, if not null, is overwritten.
  const PointCloud& Apply(PointView scan, ScanCounts* counts = nullptr);
  const PointCloud& ApplyToRows(const PointRows& scan, ScanCounts* counts = nullptr);

  /// What the last Apply returned.
  [[nodiscard]] const PointCloud& centroids() const { return centroids_; }

  /// What its tables take, used or not [bytes].
  [[nodiscard]] std::size_t held_bytes() const;

 private:
  struct Voxel {
    std::uint64_t key;
    std::uint32_t slot;  // where slots_ names it
    // x, y, z [m] and the number of points; a float would drift where 100,000 points lie in a
    // voxel.
    alignas(16) double sum[4];
  };

  /// So that so many more voxels may be hit.
  void MakeRoom(std::size_t num_more);
  void AddRuns(const VoxelRun* runs, std::size_t num_runs);
  void Grow();

  float voxel_size_m_;
  std::vector<Voxel> voxels_;  // in the order in which they were hit, and room for more
  std::uint32_t num_voxels_ = 0;
  std::vector<std::uint32_t> slots_;  // of which voxel; open addressing, a power of two
  PointCloud centroids_;
};

}  // namespace scanloc
