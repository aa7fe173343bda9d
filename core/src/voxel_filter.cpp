#include "scanloc/core/voxel_filter.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

// Of each axis the voxel's index is (distance from zero << 1 | sign): voxels are mirror images of
// each other about zero, so a reversed scan gives exactly the reversed centroids.
constexpr int kAxisBits = 20;
constexpr std::size_t kBlock = 512;
constexpr std::size_t kFirstSlots = std::size_t{1} << 15;

struct Block {
  // Per axis: the index, and the distance into the voxel in voxels, [0, 1).
  std::array<std::uint32_t, kBlock> index_x, index_y, index_z;
  std::array<float, kBlock> offset_x, offset_y, offset_z;
  std::array<std::uint32_t, kBlock> is_valid;
};

inline void SplitAxis(float value, float per_voxel, std::uint32_t& index, float& offset) {
  const float scaled = std::fabs(value) * per_voxel;
  const auto whole = static_cast<std::int32_t>(scaled);
  offset = scaled - static_cast<float>(whole);
  index = static_cast<std::uint32_t>(whole) << 1 | std::bit_cast<std::uint32_t>(value) >> 31;
}

__attribute__((target_clones("avx2", "default"))) void SplitBlock(const Point* points,
                                                                  std::size_t num_points,
                                                                  float per_voxel, Block& block) {
  for (std::size_t i = 0; i < num_points; ++i) {
    const Point& p = points[i];
    const float x = p.x;
    const float y = p.y;
    const float z = p.z;
    // NaN fails every comparison; a point that is not valid is replaced by the origin, so that the
    // conversion to integer is defined.
    const bool ok = (std::fabs(x) < limits::kMaxCoordinate_m) &
                    (std::fabs(y) < limits::kMaxCoordinate_m) &
                    (std::fabs(z) < limits::kMaxCoordinate_m);
    block.is_valid[i] = ok ? 1U : 0U;
    SplitAxis(ok ? x : 0.0F, per_voxel, block.index_x[i], block.offset_x[i]);
    SplitAxis(ok ? y : 0.0F, per_voxel, block.index_y[i], block.offset_y[i]);
    SplitAxis(ok ? z : 0.0F, per_voxel, block.index_z[i], block.offset_z[i]);
  }
}

float Coordinate(std::uint32_t index, float mean_offset, float voxel_size_m) {
  const float distance = (static_cast<float>(index >> 1) + mean_offset) * voxel_size_m;
  return (index & 1U) != 0 ? -distance : distance;
}

}  // namespace

VoxelFilter::VoxelFilter(double voxel_size_m)
    : voxel_size_m_(static_cast<float>(voxel_size_m)), slots_(kFirstSlots) {}

VoxelFilter::Voxel& VoxelFilter::Find(std::uint64_t key) {
  const std::size_t mask = slots_.size() - 1;
  const int shift = 64 - std::countr_zero(slots_.size());
  for (std::size_t i = (key * 0x9E3779B97F4A7C15ULL) >> shift;; i = (i + 1) & mask) {
    Slot& slot = slots_[i];
    if (slot.scan != scan_) {
      slot = {key, static_cast<std::uint32_t>(voxels_.size()), scan_};
      voxels_.push_back({key, 0.0F, 0.0F, 0.0F, 0});
      if (voxels_.size() * 2 > slots_.size()) Grow();
      return voxels_.back();
    }
    if (slot.key == key) return voxels_[slot.voxel];
  }
}

void VoxelFilter::Grow() {
  std::vector<Slot> slots(slots_.size() * 2);
  const std::size_t mask = slots.size() - 1;
  const int shift = 64 - std::countr_zero(slots.size());
  scan_ = 1;
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    std::size_t i = (voxels_[v].key * 0x9E3779B97F4A7C15ULL) >> shift;
    while (slots[i].scan == scan_) i = (i + 1) & mask;
    slots[i] = {voxels_[v].key, static_cast<std::uint32_t>(v), scan_};
  }
  slots_ = std::move(slots);
}

const PointCloud& VoxelFilter::Apply(PointView scan, ScanCounts* counts) {
  if (++scan_ == 0) {  // the stamps have wrapped: old slots would look taken
    std::fill(slots_.begin(), slots_.end(), Slot{});
    scan_ = 1;
  }
  voxels_.clear();
  ScanCounts found{.num_points = scan.size()};

  Block block;
  const float per_voxel = 1.0F / voxel_size_m_;
  // Neighbouring returns mostly fall into the same voxel: their sums are kept in registers and
  // go to the table once a run.
  constexpr std::uint64_t kNoKey = ~std::uint64_t{0};
  Voxel run{kNoKey, 0.0F, 0.0F, 0.0F, 0};
  const auto flush = [&] {
    if (run.num_points == 0) return;
    Voxel& voxel = Find(run.key);
    voxel.sum_x += run.sum_x;
    voxel.sum_y += run.sum_y;
    voxel.sum_z += run.sum_z;
    voxel.num_points += run.num_points;
  };
  for (std::size_t begin = 0; begin < scan.size(); begin += kBlock) {
    const std::size_t size = std::min(kBlock, scan.size() - begin);
    SplitBlock(scan.data() + begin, size, per_voxel, block);
    for (std::size_t i = 0; i < size; ++i) {
      if (block.is_valid[i] == 0) [[unlikely]] {
        const Point& p = scan[begin + i];
        const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
        ++(finite ? found.num_beyond_limit : found.num_not_finite);
        continue;
      }
      const std::uint64_t key = std::uint64_t{block.index_x[i]} |
                                std::uint64_t{block.index_y[i]} << kAxisBits |
                                std::uint64_t{block.index_z[i]} << (2 * kAxisBits);
      if (key != run.key) {
        flush();
        run = {key, 0.0F, 0.0F, 0.0F, 0};
      }
      run.sum_x += block.offset_x[i];
      run.sum_y += block.offset_y[i];
      run.sum_z += block.offset_z[i];
      ++run.num_points;
    }
  }
  flush();

  constexpr std::uint32_t kAxisMask = (1U << kAxisBits) - 1;
  centroids_.resize(voxels_.size());
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    const Voxel& voxel = voxels_[v];
    const float per_point = 1.0F / static_cast<float>(voxel.num_points);
    const auto index = [&](int axis) {
      return static_cast<std::uint32_t>(voxel.key >> (axis * kAxisBits)) & kAxisMask;
    };
    centroids_[v] = {Coordinate(index(0), voxel.sum_x * per_point, voxel_size_m_),
                     Coordinate(index(1), voxel.sum_y * per_point, voxel_size_m_),
                     Coordinate(index(2), voxel.sum_z * per_point, voxel_size_m_)};
  }
  found.num_voxels = voxels_.size();
  if (counts != nullptr) *counts = found;
  return centroids_;
}

}  // namespace scanloc
