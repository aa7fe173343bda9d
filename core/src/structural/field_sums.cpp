#include "structural/field_sums.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "scan/avx512.hpp"
#include "scan/simd.hpp"
#include "structural/horizon.hpp"

namespace scanloc {
namespace field_sums {
namespace {

constexpr bool kIsLittleEndian = std::endian::native == std::endian::little;
constexpr std::size_t kBlock = PlanarPoints::kBlock;
constexpr std::size_t kChunk = 10 * kBlock;  // what the first look at hypotheses takes

using Floats = float __attribute__((vector_size(kBlock * sizeof(float))));
using Ints = std::int32_t __attribute__((vector_size(kBlock * sizeof(std::int32_t))));
using Words = std::uint32_t __attribute__((vector_size(kBlock * sizeof(std::uint32_t))));

template <typename Vector, typename Number>
SCANLOC_INLINE Vector BlockAt(const Number* numbers) {
  Vector block;
  std::memcpy(&block, numbers, sizeof(block));
  return block;
}

SCANLOC_INLINE float SumOf(const Floats& lanes) {
  float sum = 0.0F;
  for (std::size_t lane = 0; lane < kBlock; ++lane) sum += lanes[lane];
  return sum;
}

/// Some points, turned as a field's pose says, and the cells around each: step by step for all of
/// them, so that no point waits for another's cells.
struct Chunk {
  SCANLOC_INLINE void Fill(const Placed& field, const float* __restrict x_m,
                           const float* __restrict y_m) {
    for (std::size_t i = 0; i < size; ++i) {
      turned_u[i] = field.cosine * x_m[i] - field.sine * y_m[i];
      turned_v[i] = field.sine * x_m[i] + field.cosine * y_m[i];
      // The outermost cells are at the cut-off: what lies beyond may as well lie on them.
      const float u = std::min(std::max(turned_u[i] + field.origin_u, 0.0F), field.last);
      const float v = std::min(std::max(turned_v[i] + field.origin_v, 0.0F), field.last);
      const int column = static_cast<int>(u);
      const int row = static_cast<int>(v);
      between_columns[i] = u - static_cast<float>(column);
      between_rows[i] = v - static_cast<float>(row);
      // Unsigned, so that it need not be widened before it is an address.
      cells[i] = static_cast<std::uint32_t>(row * field.side + column);
    }
    for (std::size_t i = 0; i < size; ++i) {
      std::memcpy(&lower[i], field.cells + cells[i], sizeof(lower[i]));
      std::memcpy(&upper[i], field.cells + field.side + cells[i], sizeof(upper[i]));
    }
  }

  std::size_t size = 0;                                      // whole blocks
  alignas(Floats) float turned_u[kChunk], turned_v[kChunk];  // in cells
  alignas(Floats) float between_columns[kChunk], between_rows[kChunk];
  alignas(Floats) std::uint32_t cells[kChunk];
  alignas(Floats) std::uint32_t lower[kChunk], upper[kChunk];  // two cells of a row by one load
};

/// Of a block of points the four cells around each and how far it lies between them; distances in
/// the field's unit.
struct FieldSample {
  SCANLOC_INLINE FieldSample(const Chunk& chunk, std::size_t begin)
      : between_columns(BlockAt<Floats>(chunk.between_columns + begin)),
        between_rows(BlockAt<Floats>(chunk.between_rows + begin)) {
    const auto lower = BlockAt<Words>(chunk.lower + begin);
    const auto upper = BlockAt<Words>(chunk.upper + begin);
    low = First(lower);
    low_step = Second(lower) - low;
    high = First(upper);
    high_step = Second(upper) - high;
  }
  [[nodiscard]] SCANLOC_INLINE Floats along_row(Floats start, Floats step) const {
    return start + step * between_columns;
  }
  /// Per cell along y.
  [[nodiscard]] SCANLOC_INLINE Floats slope_v() const {
    return along_row(high, high_step) - along_row(low, low_step);
  }
  /// Per cell along x.
  [[nodiscard]] SCANLOC_INLINE Floats slope_u() const {
    return low_step * (1.0F - between_rows) + high_step * between_rows;
  }
  [[nodiscard]] SCANLOC_INLINE Floats distance() const {
    return along_row(low, low_step) + slope_v() * between_rows;
  }

  Floats between_columns, between_rows, low, low_step, high, high_step;

 private:
  static SCANLOC_INLINE Floats First(Words pairs) {
    return __builtin_convertvector(
        __builtin_bit_cast(Ints, kIsLittleEndian ? pairs & 0xffffU : pairs >> 16U), Floats);
  }
  static SCANLOC_INLINE Floats Second(Words pairs) {
    return __builtin_convertvector(
        __builtin_bit_cast(Ints, kIsLittleEndian ? pairs >> 16U : pairs & 0xffffU), Floats);
  }
};

/// Calls visit(chunk, where a block begins in it) block by block.
template <typename Visitor>
SCANLOC_INLINE void ForEachBlock(const Placed& field, const float* x_m, const float* y_m,
                                 std::size_t num_points, Visitor&& visit) {
  Chunk chunk;
  for (std::size_t begin = 0; begin < num_points; begin += kChunk) {
    chunk.size = std::min(kChunk, num_points - begin);
    chunk.Fill(field, x_m + begin, y_m + begin);
    for (std::size_t block = 0; block < chunk.size; block += kBlock) visit(chunk, block);
  }
}

SCANLOC_SIMD void AddUp(const Placed& placed, float width_m, const float* x_m, const float* y_m,
                        std::size_t num_points, Sums& sums) {
  const Placed field = placed;
  Floats lanes[kNumSums] = {};
  const float inverse_width = 1.0F / width_m;
  const float slope_unit = field.unit_m * field.cells_per_m;
  ForEachBlock(
      field, x_m, y_m,
      num_points, [&](const Chunk& chunk, std::size_t begin) __attribute__((always_inline)) {
        const FieldSample sample(chunk, begin);
        const Floats distance = sample.distance() * field.unit_m;
        const Floats gradient_x = sample.slope_u() * slope_unit;
        const Floats gradient_y = sample.slope_v() * slope_unit;
        const Floats gradient_yaw = (gradient_y * BlockAt<Floats>(chunk.turned_u + begin) -
                                     gradient_x * BlockAt<Floats>(chunk.turned_v + begin)) *
                                    field.cell_m;
        const Floats scaled = distance * inverse_width;
        const Floats root = 1.0F / (1.0F + scaled * scaled);
        const Floats weight = root * root;
        const Floats weighted_x = weight * gradient_x;
        const Floats weighted_y = weight * gradient_y;
        const Floats weighted_yaw = weight * gradient_yaw;
        lanes[0] += weighted_x * gradient_x;
        lanes[1] += weighted_x * gradient_y;
        lanes[2] += weighted_x * gradient_yaw;
        lanes[3] += weighted_y * gradient_y;
        lanes[4] += weighted_y * gradient_yaw;
        lanes[5] += weighted_yaw * gradient_yaw;
        lanes[6] += weighted_x * distance;
        lanes[7] += weighted_y * distance;
        lanes[8] += weighted_yaw * distance;
      });
  for (std::size_t i = 0; i < kNumSums; ++i) sums[i] = SumOf(lanes[i]);
}

SCANLOC_INLINE Floats ExpOfMinus(Floats x) {
  const Floats octaves = x * kOctaves;
  const Ints whole = __builtin_convertvector(octaves, Ints) - 1;
  const Floats rest = octaves - __builtin_convertvector(whole, Floats);
  const auto& c = kPowerOfTwo;
  const Floats power =
      c[0] + rest * (c[1] + rest * (c[2] + rest * (c[3] + rest * (c[4] + rest * c[5]))));
  return power * __builtin_bit_cast(Floats, (whole + 127) << 23);
}

/// exp(-½ (distance / overlap_m)²) of each point.
SCANLOC_INLINE Floats OverlapAt(const Chunk& chunk, std::size_t begin, float precision) {
  const Floats distance = FieldSample(chunk, begin).distance();
  return ExpOfMinus(precision * distance * distance);
}

SCANLOC_SIMD float SumOverlap(const Placed& placed, float precision, const float* x_m,
                              const float* y_m, std::size_t num_points) {
  const Placed field = placed;
  Floats lanes = {};
  ForEachBlock(
      field, x_m, y_m,
      num_points, [&](const Chunk& chunk, std::size_t begin) __attribute__((always_inline)) {
        lanes += OverlapAt(chunk, begin, precision);
      });
  return SumOf(lanes);
}

SCANLOC_SIMD InSight SumOverlapWithin(const Placed& placed, const float* __restrict reach_squared_m,
                                      float precision, const float* x_m, const float* y_m,
                                      std::size_t num_points) {
  const Placed field = placed;
  const float middle = static_cast<float>(field.side) / 2.0F - 0.5F;
  const float from_middle_u = field.origin_u - middle;
  const float from_middle_v = field.origin_v - middle;
  const float cell_squared_m = field.cell_m * field.cell_m;
  Floats lanes = {};
  InSight sum;
  ForEachBlock(
      field, x_m, y_m,
      num_points, [&](const Chunk& chunk, std::size_t begin) __attribute__((always_inline)) {
        float seen[kBlock];
        for (std::size_t lane = 0; lane < kBlock; ++lane) {
          const float u = chunk.turned_u[begin + lane] + from_middle_u;
          const float v = chunk.turned_v[begin + lane] + from_middle_v;
          const int is_seen =
              (u * u + v * v) * cell_squared_m < reach_squared_m[Horizon::SectorOf(u, v)] ? 1 : 0;
          seen[lane] = static_cast<float>(is_seen);
          sum.num_points += is_seen;
        }
        lanes += BlockAt<Floats>(seen) * OverlapAt(chunk, begin, precision);
      });
  sum.overlap = SumOf(lanes);
  return sum;
}

}  // namespace

std::vector<Kernels> All() {
  std::vector<Kernels> all;
#ifdef __x86_64__
  if (avx512::IsQuick()) all.push_back(kAvx512);
#endif
  all.push_back({"portable", &AddUp, &SumOverlap, &SumOverlapWithin});
  return all;
}

}  // namespace field_sums
}  // namespace scanloc
