#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// Something upright seen from above: a piece of a wall, a trunk, a pole, a parked car.
/// Levelled frame, centimetres.
struct Post {
  std::int16_t x_cm = 0;
  std::int16_t y_cm = 0;

  friend bool operator==(const Post&, const Post&) = default;
};

/// What of a scan can be laid on another scan: the ground and the posts that stand on it.
///
/// The levelled frame has the sensor's origin and heading, and its z axis is the ground's normal:
/// a scan of a tilted sensor gives the same posts as one of an upright sensor.
struct Structure {
  /// Coordinates of posts lie within ±kReach_m.
  static constexpr float kReach_m = 60.0F;
  static constexpr std::size_t kMaxPosts = 8192;

  float roll_rad = 0.0F;  ///< T_level_sensor = RotY(pitch) · RotX(roll), each within ±0.6
  float pitch_rad = 0.0F;
  float height_m = 0.0F;  ///< of the sensor above the ground
  std::vector<Post> posts;

  friend bool operator==(const Structure&, const Structure&) = default;
};

/// OK, or InvalidArgument: too many posts, one out of reach, or a ground that no vehicle stands
/// on.
[[nodiscard]] absl::Status Validate(const Structure& structure);

/// Rotation that takes the sensor frame to the levelled frame.
[[nodiscard]] Eigen::Isometry3d LevelFromSensor(const Structure& structure);

/// Finds ground and posts in the voxels of a scan.
///
/// Ground: a plane through the lowest voxels within 25 m, found by iteratively reweighted least
/// squares; where there is none to be seen the sensor is taken to be upright, sensor_height_m above
/// it. Posts: cells of 0.5 m whose voxels span more than 0.8 m in height; the position is the
/// mean of the voxels.
///
/// Keeps its grids from scan to scan; use one per thread. O(voxels).
class StructureFinder {
 public:
  explicit StructureFinder(double sensor_height_m);

  [[nodiscard]] Structure Find(const PointCloud& voxels);

 private:
  struct Cell {
    float z_min, z_max, sum_x, sum_y, num_voxels;
  };

  float sensor_height_m_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> touched_;
};

}  // namespace scanloc
