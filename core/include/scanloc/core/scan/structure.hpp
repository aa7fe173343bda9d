#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// Something upright seen from above: a piece of a wall, a trunk, a pole, a parked car.
/// Levelled frame, centimetres.
struct Post {
  static constexpr int kNumHeights = 31;

  std::int16_t x_cm = 0;
  std::int16_t y_cm = 0;
  /// Bit k: something of it is k + 1/2 to k + 3/2 of PostParams::cell_m above the ground. None in
  /// maps of schema 7 and before.
  std::uint32_t heights = 0;

  friend bool operator==(const Post&, const Post&) = default;
};

/// The ground as a scan saw it.
struct Ground {
  float roll_rad = 0.0F;  ///< as in Structure
  float pitch_rad = 0.0F;
  float height_m = 0.0F;

  friend bool operator==(const Ground&, const Ground&) = default;
};

/// What of a scan can be laid on another scan: the ground and the posts that stand on it.
///
/// The levelled frame has the sensor's origin and heading, and its z axis is the ground's normal:
/// a scan of a tilted sensor gives the same posts as one of an upright sensor.
struct Structure {
  static constexpr double kMaxReach_m = 300.0;  ///< posts may lie within ± this along x and y
  static constexpr std::size_t kMaxPosts = 8192;

  float roll_rad = 0.0F;   ///< T_level_sensor = RotY(pitch) · RotX(roll), within ±π
  float pitch_rad = 0.0F;  ///< within ±π/2
  float height_m = 0.0F;   ///< of the sensor above the ground
  std::vector<Post> posts;

  [[nodiscard]] Ground ground() const { return {roll_rad, pitch_rad, height_m}; }

  friend bool operator==(const Structure&, const Structure&) = default;
};

/// OK, or InvalidArgument: too many posts, one out of reach, or a ground that no vehicle stands
/// on.
[[nodiscard]] absl::Status Validate(const Structure& structure,
                                    double reach_m = Structure::kMaxReach_m);

/// Rotation that takes the sensor frame to the levelled frame.
[[nodiscard]] Eigen::Isometry3d LevelFromSensor(const Ground& ground);
[[nodiscard]] inline Eigen::Isometry3d LevelFromSensor(const Structure& structure) {
  return LevelFromSensor(structure.ground());
}

/// A sensor that leans by more than this is mounted so, and its contexts are those of the levelled
/// frame; else those of its own, as the paper has them.
inline constexpr double kMaxUprightTilt_rad = 0.26;
/// LevelFromSensor for such a sensor, else the identity: the frame of its contexts.
[[nodiscard]] Eigen::Isometry3d ContextFromSensor(const Ground& ground);
[[nodiscard]] inline Eigen::Isometry3d ContextFromSensor(const Structure& structure) {
  return ContextFromSensor(structure.ground());
}

/// Finds ground and posts in the voxels of a scan.
///
/// Ground: a plane through the lowest voxels around, found by iteratively reweighted least squares.
/// Where much lies below that, or it leans, the sensor is mounted in some other way: then the plane
/// with the most on it and nothing below, sensor_height_m from the sensor. Where little is to be
/// seen of any ground the sensor is taken to be upright, sensor_height_m above it.
/// Posts: cells whose voxels span more than the least extent in height; the position is the mean of
/// the voxels.
///
/// Keeps its grids from scan to scan; use one per thread. O(voxels); some ms more where the ground
/// is searched for.
class StructureFinder {
 public:
  StructureFinder(const AutoParams& params, double sensor_height_m);

  /// Where of no direction can be said that it is up, knows_up, if not null, becomes false, and
  /// there are no posts.
  [[nodiscard]] Structure Find(const PointCloud& voxels, bool* knows_up = nullptr);

  /// What its tables take [bytes].
  [[nodiscard]] std::size_t held_bytes() const {
    return cells_.capacity() * sizeof(Cell) + touched_.capacity() * sizeof(touched_[0]);
  }

 private:
  struct Cell {
    float z_min = std::numeric_limits<float>::infinity();
    float z_max = -std::numeric_limits<float>::infinity();
    float sum_x = 0.0F, sum_y = 0.0F, num_voxels = 0.0F;
    std::uint32_t heights = 0;
  };

  PostParams posts_;
  GroundParams ground_;
  float sensor_height_m_;
  int side_;                 // of the grid of posts [cells]
  std::vector<Cell> cells_;  // and one for what is out of reach
  std::vector<std::uint32_t> touched_;
};

}  // namespace scanloc
