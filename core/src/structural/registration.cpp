#include "scanloc/core/structural/registration.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "scan/simd.hpp"
#include "structural/horizon.hpp"

namespace scanloc {
namespace {

constexpr bool kIsLittleEndian = std::endian::native == std::endian::little;

/// A field and where points lie in it under a pose; lengths in cells.
struct Placed {
  Placed(const DistanceField& field, const PlanarPose& pose)
      : cells(field.cells().data()),
        side(field.side()),
        unit_m(field.unit_m()),
        cell_m(field.cell_m()),
        cells_per_m(1.0F / field.cell_m()),
        cosine(static_cast<float>(std::cos(pose.yaw_rad)) * cells_per_m),
        sine(static_cast<float>(std::sin(pose.yaw_rad)) * cells_per_m),
        origin_u(static_cast<float>(pose.x_m) * cells_per_m + static_cast<float>(side) / 2.0F -
                 0.5F),
        origin_v(static_cast<float>(pose.y_m) * cells_per_m + static_cast<float>(side) / 2.0F -
                 0.5F),
        last(static_cast<float>(side) - 1.001F) {}

  const std::uint16_t* __restrict cells;
  int side;
  float unit_m, cell_m, cells_per_m, cosine, sine, origin_u, origin_v, last;
};

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

/// What the normal equations are made of: the six different elements of Σ w·J·Jᵀ, and Σ w·d·J.
constexpr std::size_t kNumSums = 9;
using Sums = std::array<float, kNumSums>;

/// One lane a point of a block, added up at the end: the same bits on any processor.
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

Eigen::Matrix3d HessianOf(const Sums& sums) {
  Eigen::Matrix3d hessian;
  hessian << sums[0], sums[1], sums[2],  //
      sums[1], sums[3], sums[4],         //
      sums[2], sums[4], sums[5];
  return hessian;
}

/// The step that Gauss-Newton takes, in x, y and yaw; drawn weakly to none.
Eigen::Vector3d Step(const Sums& sums) {
  Eigen::Matrix3d hessian = HessianOf(sums);
  // Along a corridor there is nothing to hold a pose: it must not run away for a grain of slope.
  const double held = 1e-3 + 3e-4 * (hessian(0, 0) + hessian(1, 1));
  hessian.diagonal() += Eigen::Vector3d(held, held, 1e-1);
  return hessian.inverse() * Eigen::Vector3d(sums[6], sums[7], sums[8]);
}

/// exp(-x) for x in [0, 87], to 2e-6 of it: a power of two by its bits, the rest by a polynomial.
/// Not std::exp, so that loops over it become vectors, of the same bits on any processor.
inline float ExpOfMinus(float x) {
  const float octaves = x * -1.44269504F;
  const std::int32_t whole = static_cast<std::int32_t>(octaves) - 1;
  const float rest = octaves - static_cast<float>(whole);  // in (0, 1]
  const float power =
      1.0F +
      rest * (0.693147F +
              rest * (0.240227F + rest * (0.0555044F + rest * (0.0096181F + rest * 0.0015025F))));
  return power * std::bit_cast<float>((whole + 127) << 23);
}

/// exp(-½ (distance / overlap_m)²) of a point.
inline float OverlapAt(const Placed& field, float turned_u, float turned_v, float precision) {
  const float distance = FieldSample(field, turned_u, turned_v).distance();
  return ExpOfMinus(precision * distance * distance);
}

/// Times a distance in the field's unit, squared, the exponent of the overlap.
float PrecisionOf(const Placed& field, double overlap_m) {
  const auto units = static_cast<float>(overlap_m) / field.unit_m;
  return 0.5F / (units * units);
}

/// Σ over all points, one lane a point of a block.
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

struct InSight {
  float overlap = 0.0F;
  int num_points = 0;
};

/// The same over the points within a horizon about the field's origin; and how many these are.
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

PlanarPose Inverse(const PlanarPose& pose) {
  const double cosine = std::cos(pose.yaw_rad);
  const double sine = std::sin(pose.yaw_rad);
  return {-(cosine * pose.x_m + sine * pose.y_m), -(-sine * pose.x_m + cosine * pose.y_m),
          WrapAngle(-pose.yaw_rad)};
}

PlanarPose Register(const DistanceField& field, const PlanarPoints& points, const PlanarPose& guess,
                    const RegistrationParams& params) {
  // Steps smaller than these are noise beside the posts' own centimetres.
  constexpr double kSettled_m = 0.005;
  constexpr double kSettled_rad = 0.0005;
  PlanarPose pose = guess;
  const double step_m = params.num_iterations < 2
                            ? 0.0
                            : (params.narrow_m - params.wide_m) / (params.num_iterations - 1);
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  double share = 1.0;
  for (int i = 0; i < params.num_iterations + params.max_settling; ++i) {
    const double width_m = i < params.num_iterations ? params.wide_m + step_m * i : params.narrow_m;
    Sums sums;
    AddUp(Placed(field, pose), static_cast<float>(width_m), points.x_m().data(),
          points.y_m().data(), points.x_m().size(), sums);
    Eigen::Vector3d step = Step(sums);
    // Within a cell of a post the field is flatter than it should be, and steps go twice too far:
    // without this they would go to and fro for ever.
    if (step.head<2>().dot(last.head<2>()) < 0.0) share *= 0.5;
    step *= share;
    last = step;
    pose.x_m -= step.x();
    pose.y_m -= step.y();
    pose.yaw_rad -= step.z();
    if (i >= params.num_iterations && step.head<2>().norm() < kSettled_m &&
        std::abs(step.z()) < kSettled_rad) {
      break;
    }
  }
  pose.yaw_rad = WrapAngle(pose.yaw_rad);
  return pose;
}

Eigen::Matrix3d Information(const DistanceField& field, const PlanarPoints& points,
                            const PlanarPose& T_field_points, double width_m) {
  Sums sums;
  AddUp(Placed(field, T_field_points), static_cast<float>(width_m), points.x_m().data(),
        points.y_m().data(), points.x_m().size(), sums);
  return HessianOf(sums);
}

double Overlap(const DistanceField& field, const PlanarPoints& points,
               const PlanarPose& T_field_points, double overlap_m) {
  if (points.empty()) return 0.0;
  const Placed placed(field, T_field_points);
  const float sum = SumOverlap(placed, PrecisionOf(placed, overlap_m), points.x_m().data(),
                               points.y_m().data(), points.x_m().size());
  return static_cast<double>(sum) / static_cast<double>(points.size());
}

double OverlapWithin(const Horizon& horizon, const DistanceField& field, const PlanarPoints& points,
                     const PlanarPose& T_field_points, double overlap_m) {
  const Placed placed(field, T_field_points);
  const InSight sum =
      SumOverlapWithin(placed, horizon.reach_squared_m().data(), PrecisionOf(placed, overlap_m),
                       points.x_m().data(), points.y_m().data(), points.x_m().size());
  if (sum.num_points == 0) return 0.0;
  return static_cast<double>(sum.overlap) / sum.num_points;
}

}  // namespace scanloc
