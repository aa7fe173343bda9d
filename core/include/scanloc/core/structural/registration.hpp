#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/structure.hpp"

namespace scanloc {

/// A pose in the plane: T_a_b moves b's origin to (x, y) and turns it counter-clockwise.
struct PlanarPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};
[[nodiscard]] PlanarPose Inverse(const PlanarPose& pose);

/// Positions in the plane, levelled frame [m]; structure of arrays.
///
/// Filled up with points out of every field's reach to a whole number of blocks, so that the loops
/// over them need no remainder.
class PlanarPoints {
 public:
  static constexpr std::size_t kBlock = 8;

  PlanarPoints() = default;
  /// At most max_points of the posts, evenly over their order.
  explicit PlanarPoints(std::span<const Post> posts, std::size_t max_points = Structure::kMaxPosts);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// Multiples of kBlock.
  [[nodiscard]] std::span<const float> x_m() const { return x_m_; }
  [[nodiscard]] std::span<const float> y_m() const { return y_m_; }

 private:
  std::size_t size_ = 0;
  std::vector<float> x_m_;
  std::vector<float> y_m_;
};

/// For every cell of a grid around the sensor, the distance to the nearest post, cut off at
/// cutoff_m; between cells by bilinear interpolation, which evens out how walls were sampled.
class DistanceField {
 public:
  /// Of posts within ±reach_m; others are left out.
  DistanceField(double cell_m, double reach_m, double cutoff_m);

  /// Replaces the posts. O(posts · (cutoff_m / cell_m)² + cells).
  void Fill(const PlanarPoints& posts);

  [[nodiscard]] float cell_m() const { return cell_m_; }
  [[nodiscard]] int side() const { return side_; }
  /// side × side, row after row along y. The outermost cells are at the cut-off, as all beyond is.
  [[nodiscard]] std::span<const float> distances_m() const {
    return {distance_m_.data(), static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)};
  }

 private:
  float cell_m_;
  float cutoff_m_;
  float reach_m_;
  int side_;
  std::vector<float> distance_m_;  // and room for a block behind
};

/// T_field_points that lays the points on the field's posts, from a guess.
[[nodiscard]] PlanarPose Register(const DistanceField& field, const PlanarPoints& points,
                                  const PlanarPose& guess, const RegistrationParams& params);

/// Σ w·J·Jᵀ over the points under a pose, in x, y and yaw, by Geman-McClure weights of a width:
/// what holds the pose, in no unit of noise.
[[nodiscard]] Eigen::Matrix3d Information(const DistanceField& field, const PlanarPoints& points,
                                          const PlanarPose& T_field_points, double width_m);

/// Mean of exp(-½ (distance / overlap_m)²) over the points under a pose, in [0, 1]; 0 without
/// points.
[[nodiscard]] double Overlap(const DistanceField& field, const PlanarPoints& points,
                             const PlanarPose& T_field_points, double overlap_m);

}  // namespace scanloc
