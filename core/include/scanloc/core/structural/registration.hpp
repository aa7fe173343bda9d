#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
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

/// Posts as a structure of arrays, levelled frame.
///
/// Filled up with points out of every field's reach to a whole number of blocks, so that the loops
/// over them need no remainder.
class PlanarPoints {
 public:
  static constexpr std::size_t kBlock = 8;

  PlanarPoints() = default;
  /// At most max_points of the posts, evenly over their order.
  explicit PlanarPoints(std::span<const Post> posts,
                        std::size_t max_points = Structure::kMaxPosts) {
    Assign(posts, max_points);
  }
  /// The same, in the memory of those before.
  void Assign(std::span<const Post> posts, std::size_t max_points = Structure::kMaxPosts);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// Multiples of kBlock.
  [[nodiscard]] std::span<const float> x_m() const { return x_m_; }
  [[nodiscard]] std::span<const float> y_m() const { return y_m_; }
  [[nodiscard]] std::span<const std::uint32_t> heights() const { return heights_; }

 private:
  std::size_t size_ = 0;
  std::vector<float> x_m_;
  std::vector<float> y_m_;
  std::vector<std::uint32_t> heights_;  // Post::heights
};

/// For every cell of a grid around the sensor, the distance to the nearest post, cut off at
/// cutoff_m; between cells by bilinear interpolation, which evens out how walls were sampled.
class DistanceField {
 public:
  static constexpr std::size_t kStampBlock = 16;

  /// Of posts within ±reach_m; others are left out.
  DistanceField(double cell_m, double reach_m, double cutoff_m);

  /// Replaces the posts; they count as if they stood where one of eight times eight to a cell is.
  /// O(posts · (cutoff_m / cell_m)² + cells).
  void Fill(const PlanarPoints& posts);

  [[nodiscard]] float cell_m() const { return cell_m_; }
  [[nodiscard]] int side() const { return side_; }
  /// What a distance of one in cells() is.
  [[nodiscard]] float unit_m() const { return unit_m_; }
  /// side × side, row after row along y. The outermost cells are at the cut-off, as all beyond is.
  [[nodiscard]] std::span<const std::uint16_t> cells() const {
    return {cells_.data(), static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)};
  }

 private:
  static constexpr float kCutoff = 65535.0F;  // in units
  static constexpr int kPhases = 8;

  void MakeStamps();

  float cell_m_;
  float unit_m_;
  float reach_m_;
  int side_;
  int radius_;             // of a stamp [cells]
  std::size_t stamp_row_;  // whole blocks
  // The distances around a post, by where it stands in its cell: rows, columns, v, u.
  std::vector<std::uint16_t> stamps_;
  std::vector<std::uint16_t> cells_;  // and room for a block behind
};

class Horizon;

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

/// The same over those of the points that lie within the horizon of the field's scan; 0 without.
[[nodiscard]] double OverlapWithin(const Horizon& horizon, const DistanceField& field,
                                   const PlanarPoints& points, const PlanarPose& T_field_points,
                                   double overlap_m);

}  // namespace scanloc
