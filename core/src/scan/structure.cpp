#include "scanloc/core/scan/structure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

constexpr double kMaxTilt_rad = 0.6;
constexpr double kMaxHeight_m = 100.0;

/// z = slope_x · x + slope_y · y + offset.
using Plane = Eigen::Vector3d;

/// The cell of a coordinate within ±reach_m; the sum may round up to the end of the last.
std::size_t CellOf(float coordinate_m, float reach_m, float cell_m, int num_cells) {
  const auto cell = static_cast<int>((coordinate_m + reach_m) / cell_m);
  return static_cast<std::size_t>(std::min(cell, num_cells - 1));
}

/// Cells of a grid over ±reach_m.
int SideOf(double reach_m, double cell_m) {
  return static_cast<int>(std::ceil(2.0 * reach_m / cell_m));
}

Plane FitGround(const std::vector<Eigen::Vector3d>& points, const GroundParams& params) {
  std::vector<double> heights;
  heights.reserve(points.size());
  for (const Eigen::Vector3d& p : points) heights.push_back(p.z());
  const auto low = heights.begin() + static_cast<std::ptrdiff_t>(
                                         params.low_share * static_cast<double>(heights.size()));
  std::nth_element(heights.begin(), low, heights.end());
  Plane plane(0.0, 0.0, *low);
  constexpr int kIterations = 15;
  for (int i = 0; i < kIterations; ++i) {
    const double scale_m = i < kIterations / 3 ? params.wide_m : params.narrow_m;
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Identity() * 1e-6;
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d row(p.x(), p.y(), 1.0);
      const double residual = (row.dot(plane) - p.z()) / scale_m;
      const double weight = 1.0 / ((1.0 + residual * residual) * (1.0 + residual * residual));
      hessian += weight * row * row.transpose();
      right += weight * p.z() * row;
    }
    plane = hessian.ldlt().solve(right);
  }
  return plane;
}

std::int16_t Centimetres(float value_m) {
  return static_cast<std::int16_t>(std::lround(value_m * 100.0F));
}

}  // namespace

Eigen::Isometry3d LevelFromSensor(const Structure& structure) {
  Eigen::Isometry3d rotation = Eigen::Isometry3d::Identity();
  rotation.rotate(Eigen::AngleAxisd(structure.pitch_rad, Eigen::Vector3d::UnitY()));
  rotation.rotate(Eigen::AngleAxisd(structure.roll_rad, Eigen::Vector3d::UnitX()));
  return rotation;
}

absl::Status Validate(const Structure& structure, double reach_m) {
  const auto within = [](double value, double bound) { return std::abs(value) <= bound; };
  if (!within(structure.roll_rad, kMaxTilt_rad) || !within(structure.pitch_rad, kMaxTilt_rad) ||
      !within(structure.height_m, kMaxHeight_m)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "ground at roll %g rad, pitch %g rad, %g m below; at most ±%g rad and ±%g m are allowed",
        structure.roll_rad, structure.pitch_rad, structure.height_m, kMaxTilt_rad, kMaxHeight_m));
  }
  if (structure.posts.size() > Structure::kMaxPosts) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%d posts; at most %d are allowed", structure.posts.size(), Structure::kMaxPosts));
  }
  for (const Post& post : structure.posts) {
    if (!within(post.x_cm * 0.01, reach_m) || !within(post.y_cm * 0.01, reach_m)) {
      return absl::InvalidArgumentError(absl::StrFormat("post at (%d, %d) cm is farther than %g m",
                                                        post.x_cm, post.y_cm, reach_m));
    }
  }
  return absl::OkStatus();
}

StructureFinder::StructureFinder(const AutoParams& params, double sensor_height_m)
    : posts_(params.posts),
      ground_(params.ground),
      sensor_height_m_(static_cast<float>(sensor_height_m)),
      side_(SideOf(posts_.reach_m, posts_.cell_m)),
      ground_side_(SideOf(ground_.reach_m, ground_.cell_m)),
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {}

std::vector<Eigen::Vector3d> StructureFinder::LowestPoints(const PointCloud& voxels) const {
  const auto reach_m = static_cast<float>(ground_.reach_m);
  const auto cell_m = static_cast<float>(ground_.cell_m);
  const auto side = static_cast<std::size_t>(ground_side_);
  std::vector<const Point*> lowest(side * side);
  for (const Point& p : voxels) {
    if (std::fabs(p.x) >= reach_m || std::fabs(p.y) >= reach_m) continue;
    const std::size_t column = CellOf(p.x, reach_m, cell_m, ground_side_);
    const std::size_t row = CellOf(p.y, reach_m, cell_m, ground_side_);
    const Point*& cell = lowest[row * side + column];
    if (cell == nullptr || p.z < cell->z) cell = &p;
  }
  std::vector<Eigen::Vector3d> points;
  for (const Point* p : lowest) {
    if (p != nullptr) points.emplace_back(p->x, p->y, p->z);
  }
  return points;
}

Structure StructureFinder::Find(const PointCloud& voxels) {
  Structure structure;
  structure.height_m = sensor_height_m_;
  if (const std::vector<Eigen::Vector3d> low = LowestPoints(voxels);
      static_cast<int>(low.size()) >= ground_.min_cells) {
    const Plane plane = FitGround(low, ground_);
    // The rotation that takes the plane's normal to +z, as roll about x, then pitch about y.
    const Eigen::Vector3d normal = Eigen::Vector3d(-plane.x(), -plane.y(), 1.0).normalized();
    const double roll_rad = std::atan2(normal.y(), normal.z());
    const double pitch_rad = -std::asin(std::clamp(normal.x(), -1.0, 1.0));
    const double height_m = -plane.z() * normal.z();
    if (std::abs(roll_rad) < ground_.max_tilt_rad && std::abs(pitch_rad) < ground_.max_tilt_rad &&
        std::abs(height_m) < kMaxHeight_m) {
      structure.roll_rad = static_cast<float>(roll_rad);
      structure.pitch_rad = static_cast<float>(pitch_rad);
      structure.height_m = static_cast<float>(height_m);
    }
  }

  const auto reach_m = static_cast<float>(posts_.reach_m);
  const auto cell_m = static_cast<float>(posts_.cell_m);
  const auto min_extent_m = static_cast<float>(posts_.min_extent_m);
  const Eigen::Matrix3f rotation = LevelFromSensor(structure).linear().cast<float>();
  for (const Point& sensor_point : voxels) {
    const Eigen::Vector3f p =
        rotation * Eigen::Vector3f(sensor_point.x, sensor_point.y, sensor_point.z);
    if (!(std::fabs(p.x()) < reach_m && std::fabs(p.y()) < reach_m)) continue;
    const std::size_t column = CellOf(p.x(), reach_m, cell_m, side_);
    const std::size_t row = CellOf(p.y(), reach_m, cell_m, side_);
    const auto index = static_cast<std::uint32_t>(row * static_cast<std::size_t>(side_) + column);
    Cell& cell = cells_[index];
    if (cell.num_voxels == 0.0F) {
      touched_.push_back(index);
      cell = {p.z(), p.z(), 0.0F, 0.0F, 0.0F};
    }
    cell.z_min = std::min(cell.z_min, p.z());
    cell.z_max = std::max(cell.z_max, p.z());
    cell.sum_x += p.x();
    cell.sum_y += p.y();
    cell.num_voxels += 1.0F;
  }
  for (const std::uint32_t index : touched_) {
    Cell& cell = cells_[index];
    if (cell.z_max - cell.z_min > min_extent_m && structure.posts.size() < Structure::kMaxPosts) {
      structure.posts.push_back(
          {Centimetres(cell.sum_x / cell.num_voxels), Centimetres(cell.sum_y / cell.num_voxels)});
    }
    cell.num_voxels = 0.0F;
  }
  touched_.clear();
  return structure;
}

}  // namespace scanloc
