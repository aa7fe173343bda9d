#include "lidar/lidar_sim_hits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "random.hpp"

namespace scanloc::sim {
namespace {

/// A part of a beam, by range.
struct Interval {
  double begin;
  double end;
};

Interval Intersect(const Interval& a, const Interval& b) {
  return {std::max(a.begin, b.begin), std::min(a.end, b.end)};
}

/// Where a coordinate that starts at `origin` and grows by `direction` a metre is in [low, high].
Interval Slab(double origin, double direction, double low, double high) {
  const double inverse = 1.0 / (direction == 0.0 ? 1e-300 : direction);
  const double a = (low - origin) * inverse;
  const double b = (high - origin) * inverse;
  return {std::min(a, b), std::max(a, b)};
}

/// Where a t² + 2 b t + c ≤ 0, with a > 0.
Interval Quadratic(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (discriminant <= 0.0) return {kNoHit_m, -kNoHit_m};
  const double root = std::sqrt(discriminant);
  return {(-b - root) / a, (-b + root) / a};
}

/// First range at which the beam is no higher than the streets' level plus `rise`, or `limit`.
/// Steps that the greatest slope allows never jump over the surface.
double HitTerrain(const Ground& ground, const Eigen::Vector3d& origin,
                  const Eigen::Vector3d& direction, double horizontal, double rise, double begin,
                  double limit) {
  const double closing = ground.max_slope() * horizontal - direction.z();
  if (closing <= 0.0) return limit;
  double t = begin;
  while (t < limit) {
    const double above =
        origin.z() + t * direction.z() - rise -
        ground.Height(origin.x() + t * direction.x(), origin.y() + t * direction.y());
    if (above < 1e-4) return t;
    t += above / closing;
  }
  return limit;
}

}  // namespace

SeenSolid See(const Solid& solid, std::size_t index, const Eigen::Vector3d& sensor) {
  SeenSolid seen;
  seen.solid = solid;
  seen.index = index;
  const Eigen::Vector2d to_center = solid.center - sensor.head<2>();
  const double cos = solid.axis.x();
  const double sin = solid.axis.y();
  seen.offset = {-(to_center.x() * cos + to_center.y() * sin),
                 to_center.x() * sin - to_center.y() * cos};
  seen.z_low = solid.z_min_m - sensor.z();
  seen.z_high = solid.z_max_m - sensor.z();
  seen.azimuth_rad = std::atan2(to_center.y(), to_center.x());
  const double distance = to_center.norm();
  if (solid.shape != SolidShape::kBox) {
    const double radius = solid.half_length_m;
    seen.near_m = std::max(0.0, distance - radius);
    seen.far_m = distance + radius;
    seen.half_extent_rad =
        seen.near_m > 0.0 ? std::atan2(radius, std::sqrt(distance * distance - radius * radius))
                          : std::numbers::pi;
    return seen;
  }
  const Eigen::Vector2d half(solid.half_length_m, solid.half_width_m);
  seen.near_m = (seen.offset.cwiseAbs() - half).cwiseMax(0.0).norm();
  seen.far_m = (seen.offset.cwiseAbs() + half).norm();
  seen.half_extent_rad = seen.near_m > 0.0 ? 0.0 : std::numbers::pi;
  if (seen.near_m > 0.0) {
    const Eigen::Vector2d center = -seen.offset;
    for (const double x : {-half.x(), half.x()}) {
      for (const double y : {-half.y(), half.y()}) {
        const Eigen::Vector2d corner = center + Eigen::Vector2d(x, y);
        const double angle =
            std::atan2(center.x() * corner.y() - center.y() * corner.x(), center.dot(corner));
        seen.half_extent_rad = std::max(seen.half_extent_rad, std::abs(angle));
      }
    }
  }
  return seen;
}

double HitSolid(const SeenSolid& seen, const Eigen::Vector3d& direction, std::uint64_t bits) {
  const Solid& solid = seen.solid;
  const double dx = direction.x() * solid.axis.x() + direction.y() * solid.axis.y();
  const double dy = direction.y() * solid.axis.x() - direction.x() * solid.axis.y();
  const double radius = solid.half_length_m;
  Interval inside{0.0, 0.0};
  switch (solid.shape) {
    case SolidShape::kBox:
      inside = Intersect(Slab(seen.offset.x(), dx, -radius, radius),
                         Slab(seen.offset.y(), dy, -solid.half_width_m, solid.half_width_m));
      inside = Intersect(inside, Slab(0.0, direction.z(), seen.z_low, seen.z_high));
      break;
    case SolidShape::kCylinder:
      inside = Quadratic(dx * dx + dy * dy, seen.offset.x() * dx + seen.offset.y() * dy,
                         seen.offset.squaredNorm() - radius * radius);
      inside = Intersect(inside, Slab(0.0, direction.z(), seen.z_low, seen.z_high));
      break;
    case SolidShape::kEllipsoid: {
      const double half_height = 0.5 * (seen.z_high - seen.z_low);
      const double flat = radius / half_height;  // scales z so that a sphere is left
      const double oz = -0.5 * (seen.z_low + seen.z_high) * flat;
      const double dz = direction.z() * flat;
      inside = Quadratic(dx * dx + dy * dy + dz * dz,
                         seen.offset.x() * dx + seen.offset.y() * dy + oz * dz,
                         seen.offset.squaredNorm() + oz * oz - radius * radius);
      break;
    }
  }
  if (!(inside.begin > 0.0 && inside.begin <= inside.end)) return kNoHit_m;
  if (solid.penetration_m == 0.0) return inside.begin;
  const double depth = solid.penetration_m * UnitInterval(Mix(bits, seen.index));
  return inside.begin + depth <= inside.end ? inside.begin + depth : kNoHit_m;
}

double HitGround(const Ground& ground, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double limit_m) {
  const double horizontal =
      std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
  const auto raised = [&](double t) {
    return ground.IsRaised(origin.x() + t * direction.x(), origin.y() + t * direction.y());
  };
  const double top =
      HitTerrain(ground, origin, direction, horizontal, Ground::kKerb_m, 0.0, limit_m);
  if (top >= limit_m || raised(top)) return top;
  // Below the kerb's height but over the street: the beam ends on the street or on a kerb's face.
  const double street = HitTerrain(ground, origin, direction, horizontal, 0.0, top, limit_m);
  constexpr double kProbe_m = 0.5 * Ground::kKerbCell_m;
  for (double t = top + kProbe_m; t < street; t += kProbe_m) {
    if (!raised(t)) continue;
    double low = t - kProbe_m;
    double high = t;
    for (int i = 0; i < 6; ++i) {
      const double middle = 0.5 * (low + high);
      (raised(middle) ? high : low) = middle;
    }
    return high;
  }
  return street;
}

}  // namespace scanloc::sim
