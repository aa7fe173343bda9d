#include "scanloc/core/scan/voxel_filter.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "scan/simd.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc {

/// x, y, z and the number of points.
using Float4 = float __attribute__((vector_size(16)));

/// Consecutive points in one voxel.
struct VoxelRun {
  Float4 sum;
  std::uint64_t key;
  std::size_t end;  // one behind the last of its points
};

namespace {

// Of each axis the voxel's index is (distance from zero << 1 | sign): voxels are mirror images of
// each other about zero, so a reversed scan gives exactly the reversed centroids. A key is the
// indices of x, y and z.
constexpr int kAxisBits = 20;
constexpr std::uint64_t kNoVoxel = ~std::uint64_t{0};  // of skipped points
constexpr std::uint32_t kFree = ~std::uint32_t{0};     // of slots
constexpr std::size_t kFirstSlots = std::size_t{1} << 14;

constexpr std::size_t kBlockPoints = 512;
using VoxelKeys = std::array<std::uint64_t, kBlockPoints>;

using Int4 = std::int32_t __attribute__((vector_size(16)));
using Long2 = std::int64_t __attribute__((vector_size(16)));

using Runs = std::array<VoxelRun, kBlockPoints>;

constexpr std::uint32_t kMagnitudeMask = 0x7FFFFFFFU;
constexpr std::uint32_t kLimitBits = std::bit_cast<std::uint32_t>(limits::kMaxCoordinate_m);

inline std::uint64_t AxisIndex(std::uint32_t bits, float per_voxel) {
  const float scaled = std::bit_cast<float>(bits & kMagnitudeMask) * per_voxel;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(scaled)) << 1 | bits >> 31;
}

// Integers throughout, so that the compiler may use SIMD: as bits, NaN and infinity are greater
// than every finite magnitude. What is beyond the limit is computed as the origin, then marked.
SCANLOC_SIMD void MakeKeys(const Point* __restrict points, std::size_t num_points, float per_voxel,
                           VoxelKeys& __restrict keys) {
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto x = std::bit_cast<std::uint32_t>(points[i].x);
    const auto y = std::bit_cast<std::uint32_t>(points[i].y);
    const auto z = std::bit_cast<std::uint32_t>(points[i].z);
    const std::uint32_t in_limit = static_cast<std::uint32_t>((x & kMagnitudeMask) < kLimitBits) &
                                   static_cast<std::uint32_t>((y & kMagnitudeMask) < kLimitBits) &
                                   static_cast<std::uint32_t>((z & kMagnitudeMask) < kLimitBits);
    const std::uint32_t keep = 0U - in_limit;
    const std::uint64_t skip = std::uint64_t{in_limit} - 1U;  // all ones if not in_limit
    keys[i] = AxisIndex(x & keep, per_voxel) | AxisIndex(y & keep, per_voxel) << kAxisBits |
              AxisIndex(z & keep, per_voxel) << (2 * kAxisBits) | skip;
  }
}

/// Neighbouring returns mostly fall into the same voxel, and are added up before the table is
/// asked. No branch: where a run ends cannot be predicted. Requires num_points > 0, and a float
/// behind the last point that may be read.
SCANLOC_SIMD std::size_t JoinRuns(const Point* __restrict points, std::size_t num_points,
                                  const VoxelKeys& __restrict keys, Runs& __restrict runs) {
  constexpr Int4 kXyz = {-1, -1, -1, 0};
  constexpr Float4 kOnePoint = {0.0F, 0.0F, 0.0F, 1.0F};
  VoxelRun* run = runs.data();
  std::uint64_t key = keys[0];
  Float4 sum = {};
  for (std::size_t i = 0; i < num_points; ++i) {
    const std::int64_t keep = keys[i] == key ? -1 : 0;
    key = keys[i];
    run += 1 + keep;
    Float4 point;
    std::memcpy(&point, reinterpret_cast<const char*>(points + i), sizeof(point));
    point = reinterpret_cast<Float4>((reinterpret_cast<Int4>(point) & kXyz) |
                                     reinterpret_cast<Int4>(kOnePoint));
    sum = reinterpret_cast<Float4>(reinterpret_cast<Long2>(sum) & Long2{keep, keep}) + point;
    *run = {sum, key, i + 1};
  }
  return static_cast<std::size_t>(run - runs.data()) + 1;
}

/// x y z of at least one row.
void PackRows(const float* __restrict row, std::size_t num_points, std::size_t stride,
              Point* __restrict packed) {
  auto* out = reinterpret_cast<char*>(packed);
  // Four numbers at once, of which the next point overwrites the last; behind the last row of all
  // there may be nothing.
  for (std::size_t i = 0; i + 1 < num_points; ++i) {
    std::memcpy(out, row, 4 * sizeof(float));
    out += sizeof(Point);
    row += stride;
  }
  std::memcpy(out, row, sizeof(Point));
}

void CountSkipped(PointView points, ScanCounts& counts) {
  for (const Point& p : points) {
    const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    ++(finite ? counts.num_beyond_limit : counts.num_not_finite);
  }
}

/// The mean on one axis, on the voxel's side of zero: a sum of zeros has forgotten their sign.
float Centroid(std::uint64_t key, int axis, double sum, double num_points) {
  const bool is_negative = (key >> (axis * kAxisBits) & 1U) != 0;
  return std::copysign(static_cast<float>(sum / num_points), is_negative ? -1.0F : 1.0F);
}

/// Nobody who sends a scan may know which voxels share a slot, or he could make all of them do so.
/// The order of the centroids, and so every result, does not depend on it.
std::uint64_t Hash(std::uint64_t key) {
  static const std::uint64_t multiplier = [] {
    std::random_device random;
    return (std::uint64_t{random()} << 32 | random()) | 1U;
  }();
  const std::uint64_t product = key * multiplier;
  return (product ^ product >> 32) * 0x9E3779B97F4A7C15ULL;
}

}  // namespace

VoxelFilter::VoxelFilter(double voxel_size_m)
    : voxel_size_m_(static_cast<float>(voxel_size_m)), slots_(kFirstSlots, kFree) {}

void VoxelFilter::MakeRoom(std::size_t num_more) {
  const std::size_t most = num_voxels_ + num_more;
  while (2 * most > slots_.size()) Grow();
  // And one behind them, that AddRuns asks.
  if (most >= voxels_.size()) voxels_.resize(2 * most);
}

SCANLOC_SIMD void VoxelFilter::AddRuns(const VoxelRun* runs, std::size_t num_runs) {
  Voxel* const voxels = voxels_.data();
  std::uint32_t* const slots = slots_.data();
  const std::size_t mask = slots_.size() - 1;
  const int shift = 64 - std::countr_zero(slots_.size());
  std::uint32_t num_voxels = num_voxels_;
  for (std::size_t r = 0; r < num_runs; ++r) {
    const VoxelRun& run = runs[r];
    if (run.key == kNoVoxel) continue;
    // The next voxel has this key, and a free slot names it: no branch that cannot be predicted.
    voxels[num_voxels].key = run.key;
    std::size_t slot = Hash(run.key) >> shift;
    std::uint32_t found = std::min(slots[slot], num_voxels);
    while (voxels[found].key != run.key) {
      slot = (slot + 1) & mask;
      found = std::min(slots[slot], num_voxels);
    }
    Voxel& voxel = voxels[found];
    const std::int64_t keep = found == num_voxels ? 0 : -1;
    slots[slot] = found;
    voxel.slot = static_cast<std::uint32_t>(slot);
    for (int i = 0; i < 4; ++i) {
      const auto known = std::bit_cast<std::int64_t>(voxel.sum[i]) & keep;
      voxel.sum[i] = std::bit_cast<double>(known) + run.sum[i];
    }
    num_voxels += static_cast<std::uint32_t>(1 + keep);
  }
  num_voxels_ = num_voxels;
}

void VoxelFilter::Grow() {
  slots_.assign(slots_.size() * 2, kFree);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t v = 0; v < num_voxels_; ++v) {
    std::size_t i = Hash(voxels_[v].key) >> (64 - std::countr_zero(slots_.size()));
    while (slots_[i] != kFree) i = (i + 1) & mask;
    slots_[i] = static_cast<std::uint32_t>(v);
    voxels_[v].slot = static_cast<std::uint32_t>(i);
  }
}

std::size_t VoxelFilter::held_bytes() const {
  return slots_.capacity() * sizeof(slots_[0]) + voxels_.capacity() * sizeof(Voxel) +
         centroids_.capacity() * sizeof(Point);
}

const PointCloud& VoxelFilter::Apply(PointView scan, ScanCounts* counts) {
  return ApplyToRows({reinterpret_cast<const float*>(scan.data()), scan.size(), 3}, counts);
}

const PointCloud& VoxelFilter::ApplyToRows(const PointRows& scan, ScanCounts* counts) {
  ScanCounts found{.num_points = scan.size};
  VoxelKeys keys;
  Runs runs;
  std::array<Point, kBlockPoints + 1> copied;  // stays in the processor's cache
  for (std::size_t begin = 0; begin < scan.size; begin += kBlockPoints) {
    const float* const first_row = scan.data + begin * scan.stride;
    const std::size_t num_points = std::min(kBlockPoints, scan.size - begin);
    // The last ones too, as JoinRuns looks behind the last point.
    const bool is_copied = scan.stride != 3 || begin + num_points == scan.size;
    if (is_copied) PackRows(first_row, num_points, scan.stride, copied.data());
    const PointView points(is_copied ? copied.data() : reinterpret_cast<const Point*>(first_row),
                           num_points);
    MakeKeys(points.data(), points.size(), 1.0F / voxel_size_m_, keys);
    const std::size_t num_runs = JoinRuns(points.data(), points.size(), keys, runs);
    for (std::size_t r = 0; r < num_runs; ++r) {
      if (runs[r].key != kNoVoxel) continue;
      const std::size_t first = r == 0 ? 0 : runs[r - 1].end;
      CountSkipped(points.subspan(first, runs[r].end - first), found);
    }
    MakeRoom(num_runs);
    AddRuns(runs.data(), num_runs);
  }

  centroids_.resize(num_voxels_);
  for (std::size_t v = 0; v < num_voxels_; ++v) {
    const Voxel& voxel = voxels_[v];
    centroids_[v] = {Centroid(voxel.key, 0, voxel.sum[0], voxel.sum[3]),
                     Centroid(voxel.key, 1, voxel.sum[1], voxel.sum[3]),
                     Centroid(voxel.key, 2, voxel.sum[2], voxel.sum[3])};
    slots_[voxel.slot] = kFree;  // for the next scan
  }
  found.num_voxels = num_voxels_;
  num_voxels_ = 0;
  if (counts != nullptr) *counts = found;
  return centroids_;
}

}  // namespace scanloc
