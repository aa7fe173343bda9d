#include "scanloc/core/scan/structure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "absl/strings/str_format.h"
#include "scan/ground.hpp"
#include "scan/simd.hpp"

namespace scanloc {
namespace {

/// Rounded to a float.
constexpr double kMaxRoll_rad = std::numbers::pi + 1e-6;
constexpr double kMaxPitch_rad = std::numbers::pi / 2.0 + 1e-6;

constexpr std::size_t kBlockVoxels = 64;

/// Some voxels in the levelled frame, the cell in which each stands, and the bit of its height.
struct PlacedVoxels {
  std::array<float, kBlockVoxels> x_m, y_m, z_m;
  std::array<std::int32_t, kBlockVoxels> cells;
  std::array<std::uint32_t, kBlockVoxels> heights;
};

/// What voxels are placed by.
struct PostGrid {
  Eigen::Matrix3f level_from_sensor;
  float reach_m, cell_m, sensor_height_m;
  int side;
};

/// The cell of a coordinate; the sum of one within reach may round up to the end of the last.
inline std::int32_t CellOf(float coordinate_m, const PostGrid& grid) {
  const auto cell = static_cast<std::int32_t>((coordinate_m + grid.reach_m) / grid.cell_m);
  return std::min(std::max(cell, 0), grid.side - 1);
}

/// Those out of reach stand in the cell behind the grid's. Without branches, so that the loop
/// becomes vectors.
SCANLOC_SIMD void PlaceVoxels(const PostGrid& given, const Point* __restrict voxels,
                              std::size_t num_voxels, PlacedVoxels& __restrict placed) {
  const PostGrid grid = given;
  const Eigen::Matrix3f& turn = grid.level_from_sensor;
  for (std::size_t i = 0; i < num_voxels; ++i) {
    const Point p = voxels[i];
    const float x_m = turn(0, 0) * p.x + (turn(0, 1) * p.y + turn(0, 2) * p.z);
    const float y_m = turn(1, 0) * p.x + (turn(1, 1) * p.y + turn(1, 2) * p.z);
    const float z_m = turn(2, 0) * p.x + (turn(2, 1) * p.y + turn(2, 2) * p.z);
    const std::int32_t is_near = static_cast<std::int32_t>(std::fabs(x_m) < grid.reach_m) &
                                 static_cast<std::int32_t>(std::fabs(y_m) < grid.reach_m);
    const std::int32_t cell = CellOf(y_m, grid) * grid.side + CellOf(x_m, grid);
    const float height = (z_m + grid.sensor_height_m) / grid.cell_m - 0.5F;
    const std::uint32_t is_told =
        static_cast<std::uint32_t>(height >= 0.0F) &
        static_cast<std::uint32_t>(height < static_cast<float>(Post::kNumHeights));
    const auto level = static_cast<std::uint32_t>(static_cast<std::int32_t>(height));
    placed.x_m[i] = x_m;
    placed.y_m[i] = y_m;
    placed.z_m[i] = z_m;
    placed.cells[i] = is_near * cell + (1 - is_near) * grid.side * grid.side;
    placed.heights[i] = is_told << (level & 31U);
  }
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
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) + 1) {
  cells_.back().num_voxels = 1.0F;
}

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

  const PostGrid grid = {.level_from_sensor = LevelFromSensor(structure).linear().cast<float>(),
                         .reach_m = static_cast<float>(posts_.reach_m),
                         .cell_m = static_cast<float>(posts_.cell_m),
                         .sensor_height_m = structure.height_m,
                         .side = side_};
  touched_.resize(voxels.size() + 1);
  std::size_t num_touched = 0;
  PlacedVoxels placed;
  for (std::size_t begin = 0; begin < voxels.size(); begin += kBlockVoxels) {
    const std::size_t num_placed = std::min(kBlockVoxels, voxels.size() - begin);
    PlaceVoxels(grid, voxels.data() + begin, num_placed, placed);
    for (std::size_t i = 0; i < num_placed; ++i) __builtin_prefetch(&cells_[placed.cells[i]], 1);
    for (std::size_t i = 0; i < num_placed; ++i) {
      const auto index = static_cast<std::uint32_t>(placed.cells[i]);
      Cell& cell = cells_[index];
      // No branch: which voxel is the first of its cell cannot be predicted.
      touched_[num_touched] = index;
      num_touched += cell.num_voxels == 0.0F ? 1 : 0;
      cell.z_min = std::min(cell.z_min, placed.z_m[i]);
      cell.z_max = std::max(cell.z_max, placed.z_m[i]);
      cell.sum_x += placed.x_m[i];
      cell.sum_y += placed.y_m[i];
      cell.num_voxels += 1.0F;
      cell.heights |= placed.heights[i];
    }
  }
  const auto min_extent_m = static_cast<float>(posts_.min_extent_m);
  touched_.resize(num_touched);
  for (const std::uint32_t index : touched_) {
    Cell& cell = cells_[index];
    if (cell.z_max - cell.z_min > min_extent_m && structure.posts.size() < Structure::kMaxPosts) {
      structure.posts.push_back({Centimetres(cell.sum_x / cell.num_voxels),
                                 Centimetres(cell.sum_y / cell.num_voxels), cell.heights});
    }
    cell = {};
  }
  return structure;
}

}  // namespace scanloc
