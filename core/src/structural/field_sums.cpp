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

/// The four cells around a point and how far it lies between them; distances in the field's unit.
struct FieldSample {
  FieldSample(const Placed& field, float turned_u, float turned_v) {
    // The outermost cells are at the cut-off: what lies beyond may as well lie on them.
    const float u = std::min(std::max(turned_u + field.origin_u, 0.0F), field.last);
    const float v = std::min(std::max(turned_v + field.origin_v, 0.0F), field.last);
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    between_columns = u - static_cast<float>(column);
    between_rows = v - static_cast<float>(row);
    // Unsigned, so that it need not be widened before it is an address.
    const auto cell = static_cast<std::uint32_t>(row * field.side + column);
    const std::uint32_t lower = NeighborsAt(field.cells, cell);
    const std::uint32_t upper = NeighborsAt(field.cells + field.side, cell);
    low = First(lower);
    low_step = Second(lower) - low;
    high = First(upper);
    high_step = Second(upper) - high;
  }
  [[nodiscard]] float along_row(float start, float step) const {
    return start + step * between_columns;
  }
  /// Per cell along y.
  [[nodiscard]] float slope_v() const {
    return along_row(high, high_step) - along_row(low, low_step);
  }
  /// Per cell along x.
  [[nodiscard]] float slope_u() const {
    return low_step * (1.0F - between_rows) + high_step * between_rows;
  }
  [[nodiscard]] float distance() const {
    return along_row(low, low_step) + slope_v() * between_rows;
  }

  float between_columns, between_rows, low, low_step, high, high_step;

 private:
  /// Two cells of a row by one load.
  static std::uint32_t NeighborsAt(const std::uint16_t* cells, std::uint32_t cell) {
    std::uint32_t pair;
    std::memcpy(&pair, cells + cell, sizeof(pair));
    return pair;
  }
  static float First(std::uint32_t pair) {
    return static_cast<float>(
        static_cast<std::int32_t>(kIsLittleEndian ? pair & 0xffffU : pair >> 16U));
  }
  static float Second(std::uint32_t pair) {
    return static_cast<float>(
        static_cast<std::int32_t>(kIsLittleEndian ? pair >> 16U : pair & 0xffffU));
  }
};

SCANLOC_SIMD void AddUp(const Placed& placed, float width_m, const float* __restrict x_m,
                        const float* __restrict y_m, std::size_t num_points, Sums& sums) {
  const Placed field = placed;
  float lanes[kNumSums][PlanarPoints::kBlock] = {};
  const float inverse_width = 1.0F / width_m;
  const float slope_unit = field.unit_m * field.cells_per_m;
  for (std::size_t begin = 0; begin < num_points; begin += PlanarPoints::kBlock) {
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const float x = x_m[begin + lane];
      const float y = y_m[begin + lane];
      const float turned_u = field.cosine * x - field.sine * y;
      const float turned_v = field.sine * x + field.cosine * y;
      const FieldSample sample(field, turned_u, turned_v);
      const float distance = sample.distance() * field.unit_m;
      const float gradient_x = sample.slope_u() * slope_unit;
      const float gradient_y = sample.slope_v() * slope_unit;
      const float gradient_yaw = (gradient_y * turned_u - gradient_x * turned_v) * field.cell_m;
      const float scaled = distance * inverse_width;
      const float root = 1.0F / (1.0F + scaled * scaled);
      const float weight = root * root;
      const float weighted_x = weight * gradient_x;
      const float weighted_y = weight * gradient_y;
      const float weighted_yaw = weight * gradient_yaw;
      lanes[0][lane] += weighted_x * gradient_x;
      lanes[1][lane] += weighted_x * gradient_y;
      lanes[2][lane] += weighted_x * gradient_yaw;
      lanes[3][lane] += weighted_y * gradient_y;
      lanes[4][lane] += weighted_y * gradient_yaw;
      lanes[5][lane] += weighted_yaw * gradient_yaw;
      lanes[6][lane] += weighted_x * distance;
      lanes[7][lane] += weighted_y * distance;
      lanes[8][lane] += weighted_yaw * distance;
    }
  }
  for (std::size_t i = 0; i < kNumSums; ++i) {
    sums[i] = 0.0F;
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) sums[i] += lanes[i][lane];
  }
}

inline float ExpOfMinus(float x) {
  const float octaves = x * kOctaves;
  const std::int32_t whole = static_cast<std::int32_t>(octaves) - 1;
  const float rest = octaves - static_cast<float>(whole);
  const auto& c = kPowerOfTwo;
  const float power =
      c[0] + rest * (c[1] + rest * (c[2] + rest * (c[3] + rest * (c[4] + rest * c[5]))));
  return power * std::bit_cast<float>((whole + 127) << 23);
}

/// exp(-½ (distance / overlap_m)²) of a point.
inline float OverlapAt(const Placed& field, float turned_u, float turned_v, float precision) {
  const float distance = FieldSample(field, turned_u, turned_v).distance();
  return ExpOfMinus(precision * distance * distance);
}

SCANLOC_SIMD float SumOverlap(const Placed& placed, float precision, const float* __restrict x_m,
                              const float* __restrict y_m, std::size_t num_points) {
  const Placed field = placed;
  float lanes[PlanarPoints::kBlock] = {};
  for (std::size_t begin = 0; begin < num_points; begin += PlanarPoints::kBlock) {
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const float x = x_m[begin + lane];
      const float y = y_m[begin + lane];
      lanes[lane] += OverlapAt(field, field.cosine * x - field.sine * y,
                               field.sine * x + field.cosine * y, precision);
    }
  }
  float sum = 0.0F;
  for (const float lane : lanes) sum += lane;
  return sum;
}

SCANLOC_SIMD InSight SumOverlapWithin(const Placed& placed, const float* __restrict reach_squared_m,
                                      float precision, const float* __restrict x_m,
                                      const float* __restrict y_m, std::size_t num_points) {
  const Placed field = placed;
  const float middle = static_cast<float>(field.side) / 2.0F - 0.5F;
  const float from_middle_u = field.origin_u - middle;
  const float from_middle_v = field.origin_v - middle;
  const float cell_squared_m = field.cell_m * field.cell_m;
  float lanes[PlanarPoints::kBlock] = {};
  int counts[PlanarPoints::kBlock] = {};
  for (std::size_t begin = 0; begin < num_points; begin += PlanarPoints::kBlock) {
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const float x = x_m[begin + lane];
      const float y = y_m[begin + lane];
      const float turned_u = field.cosine * x - field.sine * y;
      const float turned_v = field.sine * x + field.cosine * y;
      const float u = turned_u + from_middle_u;
      const float v = turned_v + from_middle_v;
      const int is_seen =
          (u * u + v * v) * cell_squared_m < reach_squared_m[Horizon::SectorOf(u, v)] ? 1 : 0;
      lanes[lane] += static_cast<float>(is_seen) * OverlapAt(field, turned_u, turned_v, precision);
      counts[lane] += is_seen;
    }
  }
  InSight sum;
  for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
    sum.overlap += lanes[lane];
    sum.num_points += counts[lane];
  }
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
