#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::sim {

/// What a town is made of: the same options give the same town, bit for bit, on any machine.
struct TownOptions {
  std::uint64_t town_seed = 1;
  /// Length of the route through the town [m], in [20, 100000]. Towns of different lengths differ.
  double length_m = 1000.0;
  /// Share of the route along which, years later, everything beside the street was torn down and
  /// built anew, in [0, 1]: whole streets; the others stay as they are.
  double rebuilt_share = 0.0;
  std::uint64_t rebuilt_seed = 1;  ///< another number, other streets and other houses
};

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const TownOptions& options);

enum class SolidShape : std::uint8_t { kBox, kCylinder, kEllipsoid };

/// A body with a vertical axis that laser beams end on. Map frame, metres.
struct Solid {
  SolidShape shape = SolidShape::kBox;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< of the footprint
  Eigen::Vector2d axis = Eigen::Vector2d::UnitX();   ///< unit vector along the length of a box
  double half_length_m = 0.0;                        ///< of a box; the radius of the others
  double half_width_m = 0.0;                         ///< of a box only
  double z_min_m = 0.0;
  double z_max_m = 0.0;
  /// Foliage: a beam ends up to this deep inside the body, or passes if the body is thinner there.
  double penetration_m = 0.0;
};

/// A curve in the plane with points at equal distances along it.
class Path {
 public:
  static constexpr double kStep_m = 0.5;

  Path() = default;
  /// Resamples a polyline of at least two distinct points.
  explicit Path(const std::vector<Eigen::Vector2d>& polyline);

  [[nodiscard]] double length_m() const { return length_m_; }
  [[nodiscard]] const std::vector<Eigen::Vector2d>& points() const { return points_; }
  /// The point and the unit tangent at a distance from the beginning, clamped to the curve [m].
  [[nodiscard]] Eigen::Vector2d At(double distance_m) const;
  [[nodiscard]] Eigen::Vector2d Tangent(double distance_m) const;

 private:
  std::vector<Eigen::Vector2d> points_;
  double length_m_ = 0.0;
};

/// The tangent turned a quarter to the left.
[[nodiscard]] inline Eigen::Vector2d LeftOf(const Eigen::Vector2d& tangent) {
  return {-tangent.y(), tangent.x()};
}

/// The surface of a town: gently rolling terrain, with everything but the streets raised by a kerb.
class Ground {
 public:
  static constexpr double kKerb_m = 0.12;
  static constexpr double kTerrainCell_m = 8.0;
  static constexpr double kKerbCell_m = 0.5;

  /// A flat street without end at z = 0.
  Ground() = default;
  /// Flat at z = 0 from `lower` to `upper`, raised everywhere; to be shaped by the world's maker.
  Ground(const Eigen::Vector2d& lower, const Eigen::Vector2d& upper);

  struct Wave {
    Eigen::Vector2d number;  ///< radians a metre
    double phase;
    double height_m;
  };
  /// Makes the streets' level the sum of the waves.
  void Shape(std::span<const Wave> waves);
  /// Lowers the kerb within `half_width_m` of every point of the path.
  void CarveStreet(const Path& center, double half_width_m);

  /// Height of the streets' level [m]; the kerb comes on top where IsRaised.
  [[nodiscard]] double Height(double x, double y) const;
  [[nodiscard]] bool IsRaised(double x, double y) const;
  /// Of the streets' level; no greater slope occurs in any direction.
  [[nodiscard]] double max_slope() const { return max_slope_; }

 private:
  Eigen::Vector2d lower_ = Eigen::Vector2d::Zero();
  int num_columns_ = 0;
  int num_rows_ = 0;
  std::vector<double> heights_m_;
  double max_slope_ = 0.0;
  int num_kerb_columns_ = 0;
  int num_kerb_rows_ = 0;
  std::vector<bool> lowered_;
};

/// A street: traffic keeps right.
struct Street {
  Path center;
  double lanes_half_m = 0.0;    ///< from the centre line to the edge of the moving lanes
  double kerb_half_m = 0.0;     ///< to the kerb, beyond the parking strip
  double begin_margin_m = 0.0;  ///< length that belongs to the crossing at the beginning
  double end_margin_m = 0.0;
  int num_lanes = 1;  ///< each way
};

/// Where a vehicle may be parked.
struct ParkingSlot {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis = Eigen::Vector2d::UnitX();
};

/// What is the same in all sessions of a town.
struct Town {
  TownOptions options;
  Ground ground;
  std::vector<Street> streets;
  /// Centre line of the drive, with rounded corners; exactly options.length_m long.
  Path route;
  std::vector<Solid> fixed;       ///< buildings, walls, trees, poles, signs
  std::vector<Solid> changeable;  ///< hedges, containers: gone in some sessions
  std::vector<ParkingSlot> parking;
  std::vector<Path> rebuilt;  ///< centre lines of the streets that were
};

/// InvalidArgument if the options are bad. O(length).
[[nodiscard]] absl::StatusOr<Town> MakeTown(const TownOptions& options);

}  // namespace scanloc::sim
