#include "scan/ground.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace scanloc {
namespace {

/// A robot seldom leans by more unless its sensor is mounted so.
constexpr double kPlainTilt_rad = 15.0 * std::numbers::pi / 180.0;
/// Of a plain ground. Measured: at most 0.16 on a campus with slopes; 0.23 and more where the plane
/// cuts through the scene.
constexpr double kMaxShareBelow = 0.25;
/// Of one that no search confirms, for the sensor's height may not be as stated.
constexpr double kMaxShareBelowUnconfirmed = 0.35;
/// Of one that leans, likewise.
constexpr double kMaxShareBelowLeaning = 0.1;

/// z = slope_x · x + slope_y · y + offset.
using Slope = Eigen::Vector3d;

std::vector<Eigen::Vector3d> LowestPoints(const PointCloud& voxels, const GroundParams& params) {
  const auto reach_m = static_cast<float>(params.reach_m);
  const auto cell_m = static_cast<float>(params.cell_m);
  const auto side = static_cast<std::size_t>(std::ceil(2.0 * params.reach_m / params.cell_m));
  const auto cell_of = [&](float coordinate_m) {
    return std::min(static_cast<std::size_t>((coordinate_m + reach_m) / cell_m), side - 1);
  };
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  std::vector<Point> lowest(side * side, Point{0.0F, 0.0F, kNothing});
  for (const Point& p : voxels) {
    if (std::fabs(p.x) >= reach_m || std::fabs(p.y) >= reach_m) continue;
    Point& cell = lowest[cell_of(p.y) * side + cell_of(p.x)];
    // No branch: which one is the lowest so far cannot be predicted.
    const Point* const lower = p.z < cell.z ? &p : &cell;
    cell = *lower;
  }
  std::vector<Eigen::Vector3d> points;
  for (const Point& p : lowest) {
    if (p.z != kNothing) points.emplace_back(p.x, p.y, p.z);
  }
  return points;
}

Slope FitSlope(const std::vector<Eigen::Vector3d>& points, const GroundParams& params) {
  std::vector<double> heights;
  heights.reserve(points.size());
  for (const Eigen::Vector3d& p : points) heights.push_back(p.z());
  const auto low = heights.begin() + static_cast<std::ptrdiff_t>(
                                         params.low_share * static_cast<double>(heights.size()));
  std::nth_element(heights.begin(), low, heights.end());
  Slope slope(0.0, 0.0, *low);
  constexpr int kIterations = 15;
  for (int i = 0; i < kIterations; ++i) {
    const double scale_m = i < kIterations / 3 ? params.wide_m : params.narrow_m;
    // One by one: matrices would go through memory at each point.
    double xx = 1e-6, xy = 0.0, x1 = 0.0, yy = 1e-6, y1 = 0.0, num = 1e-6;
    double xz = 0.0, yz = 0.0, z1 = 0.0;
    for (const Eigen::Vector3d& p : points) {
      const double residual = (p.x() * slope.x() + p.y() * slope.y() + slope.z() - p.z()) / scale_m;
      const double weight = 1.0 / ((1.0 + residual * residual) * (1.0 + residual * residual));
      const Eigen::Vector3d weighted = weight * p;
      xx += weighted.x() * p.x();
      xy += weighted.y() * p.x();
      x1 += weighted.x();
      yy += weighted.y() * p.y();
      y1 += weighted.y();
      num += weight;
      xz += weighted.z() * p.x();
      yz += weighted.z() * p.y();
      z1 += weighted.z();
    }
    Eigen::Matrix3d hessian;
    hessian << xx, xy, x1,  //
        xy, yy, y1,         //
        x1, y1, num;
    slope = hessian.ldlt().solve(Eigen::Vector3d(xz, yz, z1));
  }
  return slope;
}

/// The plane through the lowest points, unless it leans too much; none where they are few.
std::optional<GroundPlane> FitLowest(const PointCloud& voxels, const GroundParams& params) {
  const std::vector<Eigen::Vector3d> low = LowestPoints(voxels, params);
  if (static_cast<int>(low.size()) < params.min_cells) return std::nullopt;
  const Slope slope = FitSlope(low, params);
  const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  return GroundPlane{normal, -slope.z() * normal.z()};
}

bool Leans(const GroundPlane& plane, double most_rad) {
  const RollPitch lean = LeanOf(plane);
  return std::abs(lean.roll_rad) >= most_rad || std::abs(lean.pitch_rad) >= most_rad;
}

/// The plane that was found roughly, as that of a scan whose sensor stands upright would be.
GroundPlane Refine(const GroundPlane& rough, const PointCloud& voxels, const GroundParams& params) {
  const Eigen::Matrix3d level =
      Eigen::Quaterniond::FromTwoVectors(rough.normal, Eigen::Vector3d::UnitZ()).matrix();
  const Eigen::Matrix3f turn = level.cast<float>();
  PointCloud turned;
  turned.reserve(voxels.size());
  for (const Point& p : voxels) {
    const Eigen::Vector3f q = turn * Eigen::Vector3f(p.x, p.y, p.z);
    turned.push_back({q.x(), q.y(), q.z()});
  }
  const std::optional<GroundPlane> fine = FitLowest(turned, params);
  if (!fine || Leans(*fine, kPlainTilt_rad) ||
      ShareBelow(turned, *fine, params) >
          ShareBelow(turned, {.height_m = rough.height_m}, params)) {
    return rough;
  }
  return {level.transpose() * fine->normal, fine->height_m};
}

}  // namespace

std::optional<GroundPlane> FindGround(const PointCloud& voxels, const GroundParams& params,
                                      double sensor_height_m) {
  const GroundPlane upright{.height_m = sensor_height_m};
  std::optional<GroundPlane> lowest = FitLowest(voxels, params);
  const bool is_fit = lowest && !Leans(*lowest, params.max_tilt_rad) &&
                      std::abs(lowest->height_m) < kMaxSensorHeight_m;
  const double share_below = is_fit ? ShareBelow(voxels, *lowest, params) : 1.0;
  if (is_fit && !Leans(*lowest, kPlainTilt_rad) && share_below <= kMaxShareBelow) return lowest;
  if (const auto found = SearchGround(voxels, params, sensor_height_m)) {
    return Refine(*found, voxels, params);
  }
  if (!lowest) return upright;
  const bool leans = Leans(*lowest, kPlainTilt_rad);
  if (is_fit && share_below <= (leans ? kMaxShareBelowLeaning : kMaxShareBelowUnconfirmed)) {
    return lowest;
  }
  return std::nullopt;
}

}  // namespace scanloc
