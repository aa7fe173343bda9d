#include "scanloc/core/scan/structure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "absl/strings/str_format.h"
#include "scan/ground.hpp"

namespace scanloc {
namespace {

/// Rounded to a float.
constexpr double kMaxRoll_rad = std::numbers::pi + 1e-6;
constexpr double kMaxPitch_rad = std::numbers::pi / 2.0 + 1e-6;

/// The cell of a coordinate within ±reach_m; the sum may round up to the end of the last.
std::size_t CellOf(float coordinate_m, float reach_m, float cell_m, int num_cells) {
  const auto cell = static_cast<int>((coordinate_m + reach_m) / cell_m);
  return static_cast<std::size_t>(std::min(cell, num_cells - 1));
}

/// Cells of a grid over ±reach_m.
int SideOf(double reach_m, double cell_m) {
  return static_cast<int>(std::ceil(2.0 * reach_m / cell_m));
}

std::int16_t Centimetres(float value_m) {
  return static_cast<std::int16_t>(std::lround(value_m * 100.0F));
}

}  // namespace

Eigen::Isometry3d LevelFromSensor(const Ground& ground) {
  Eigen::Isometry3d rotation = Eigen::Isometry3d::Identity();
  rotation.rotate(Eigen::AngleAxisd(ground.pitch_rad, Eigen::Vector3d::UnitY()));
  rotation.rotate(Eigen::AngleAxisd(ground.roll_rad, Eigen::Vector3d::UnitX()));
  return rotation;
}

Eigen::Isometry3d ContextFromSensor(const Ground& ground) {
  const Eigen::Isometry3d level = LevelFromSensor(ground);
  const bool is_upright = level.linear()(2, 2) >= std::cos(kMaxUprightTilt_rad);
  return is_upright ? Eigen::Isometry3d::Identity() : level;
}

absl::Status Validate(const Structure& structure, double reach_m) {
  const auto within = [](double value, double bound) { return std::abs(value) <= bound; };
  if (!within(structure.roll_rad, kMaxRoll_rad) || !within(structure.pitch_rad, kMaxPitch_rad) ||
      !within(structure.height_m, kMaxSensorHeight_m)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "ground at roll %g rad, pitch %g rad, %g m below; at most ±π, ±π/2 and ±%g m are allowed",
        structure.roll_rad, structure.pitch_rad, structure.height_m, kMaxSensorHeight_m));
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
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {}

Structure StructureFinder::Find(const PointCloud& voxels, bool* knows_up) {
  Structure structure;
  structure.height_m = sensor_height_m_;
  const std::optional<GroundPlane> ground = FindGround(voxels, ground_, sensor_height_m_);
  if (knows_up != nullptr) *knows_up = ground.has_value();
  if (!ground) return structure;
  const RollPitch lean = LeanOf(*ground);
  structure.roll_rad = static_cast<float>(lean.roll_rad);
  structure.pitch_rad = static_cast<float>(lean.pitch_rad);
  structure.height_m = static_cast<float>(ground->height_m);

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
      cell = {p.z(), p.z(), 0.0F, 0.0F, 0.0F, 0U};
    }
    cell.z_min = std::min(cell.z_min, p.z());
    cell.z_max = std::max(cell.z_max, p.z());
    cell.sum_x += p.x();
    cell.sum_y += p.y();
    cell.num_voxels += 1.0F;
    const float height = (p.z() + structure.height_m) / cell_m - 0.5F;
    if (height >= 0.0F && height < static_cast<float>(Post::kNumHeights)) {
      cell.heights |= 1U << static_cast<unsigned>(height);
    }
  }
  for (const std::uint32_t index : touched_) {
    Cell& cell = cells_[index];
    if (cell.z_max - cell.z_min > min_extent_m && structure.posts.size() < Structure::kMaxPosts) {
      structure.posts.push_back({Centimetres(cell.sum_x / cell.num_voxels),
                                 Centimetres(cell.sum_y / cell.num_voxels), cell.heights});
    }
    cell.num_voxels = 0.0F;
  }
  touched_.clear();
  return structure;
}

}  // namespace scanloc
