#pragma once

#include <Eigen/Core>
#include <vector>

namespace scanloc::sim {

/// A way through a scene, on its floor: straight from corner to corner, up and down with it.
/// Straight up is a lift: no way is gone in it.
class Walk {
 public:
  /// Of at least two corners, of which no two in a row are the same.
  explicit Walk(std::vector<Eigen::Vector3d> corners);

  [[nodiscard]] double length_m() const { return ends_m_.back(); }
  /// Clamped to the way.
  [[nodiscard]] Eigen::Vector3d At(double along_m) const;
  /// A unit vector in the plane. Who walks rounds the corners.
  [[nodiscard]] Eigen::Vector2d Heading(double along_m) const;
  /// Rise a metre in the plane; 0 where it is steeper than any ramp, as on stairs or in a lift.
  [[nodiscard]] double Slope(double along_m) const;

 private:
  std::vector<Eigen::Vector3d> corners_;
  std::vector<double> ends_m_;  // distance from the beginning to each corner
};

/// What a step counts for [m].
[[nodiscard]] double WayOf(const Eigen::Vector3d& step);

}  // namespace scanloc::sim
