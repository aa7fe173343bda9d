#include "scanloc/core/structural/registration.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kBlock = PlanarPoints::kBlock;

/// Points that fill up a block: out of reach of every field, so that they add nothing.
constexpr float kFarPoint_m = 1.0e6F;

/// A field and where points lie in it under a pose; lengths in cells.
struct Placed {
  Placed(const DistanceField& field, const PlanarPose& pose)
      : distances_m(field.distances_m().data()),
        side(field.side()),
        cell_m(field.cell_m()),
        cells_per_m(1.0F / field.cell_m()),
        cosine(static_cast<float>(std::cos(pose.yaw_rad)) * cells_per_m),
        sine(static_cast<float>(std::sin(pose.yaw_rad)) * cells_per_m),
        origin_u(static_cast<float>(pose.x_m) * cells_per_m + static_cast<float>(side) / 2.0F -
                 0.5F),
        origin_v(static_cast<float>(pose.y_m) * cells_per_m + static_cast<float>(side) / 2.0F -
                 0.5F),
        last(static_cast<float>(side) - 1.001F) {}

  const float* __restrict distances_m;
  int side;
  float cell_m, cells_per_m, cosine, sine, origin_u, origin_v, last;
};

/// The four cells around a point and how far it lies between them.
struct Sample {
  Sample(const Placed& field, float turned_u, float turned_v) {
    // The outermost cells are at the cut-off: what lies beyond may as well lie on them.
    const float u = std::min(std::max(turned_u + field.origin_u, 0.0F), field.last);
    const float v = std::min(std::max(turned_v + field.origin_v, 0.0F), field.last);
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    between_columns = u - static_cast<float>(column);
    between_rows = v - static_cast<float>(row);
    const int cell = row * field.side + column;
    low = field.distances_m[cell];
    low_step = field.distances_m[cell + 1] - low;
    high = field.distances_m[cell + field.side];
    high_step = field.distances_m[cell + field.side + 1] - high;
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
  [[nodiscard]] float distance_m() const {
    return along_row(low, low_step) + slope_v() * between_rows;
  }

  float between_columns, between_rows, low, low_step, high, high_step;
};

/// What the normal equations are made of: the six different elements of Σ w·J·Jᵀ, and Σ w·d·J.
constexpr std::size_t kNumSums = 9;
using Sums = std::array<float, kNumSums>;

/// One lane a point of a block, added up at the end: the same bits on any processor.
SCANLOC_SIMD void AddUp(const Placed& placed, float width_m, const float* __restrict x_m,
                        const float* __restrict y_m, std::size_t num_points, Sums& sums) {
  const Placed field = placed;
  float lanes[kNumSums][kBlock] = {};
  const float inverse_width = 1.0F / width_m;
  for (std::size_t begin = 0; begin < num_points; begin += kBlock) {
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const float x = x_m[begin + lane];
      const float y = y_m[begin + lane];
      const float turned_u = field.cosine * x - field.sine * y;
      const float turned_v = field.sine * x + field.cosine * y;
      const Sample sample(field, turned_u, turned_v);
      const float distance = sample.distance_m();
      const float gradient_x = sample.slope_u() * field.cells_per_m;
      const float gradient_y = sample.slope_v() * field.cells_per_m;
      const float gradient_yaw = (gradient_y * turned_u - gradient_x * turned_v) * field.cell_m;
      const float scaled = distance * inverse_width;
      const float root = 1.0F / (1.0F + scaled * scaled);
      const float weight = root * root;
      lanes[0][lane] += weight * gradient_x * gradient_x;
      lanes[1][lane] += weight * gradient_x * gradient_y;
      lanes[2][lane] += weight * gradient_x * gradient_yaw;
      lanes[3][lane] += weight * gradient_y * gradient_y;
      lanes[4][lane] += weight * gradient_y * gradient_yaw;
      lanes[5][lane] += weight * gradient_yaw * gradient_yaw;
      lanes[6][lane] += weight * distance * gradient_x;
      lanes[7][lane] += weight * distance * gradient_y;
      lanes[8][lane] += weight * distance * gradient_yaw;
    }
  }
  for (std::size_t i = 0; i < kNumSums; ++i) {
    sums[i] = 0.0F;
    for (std::size_t lane = 0; lane < kBlock; ++lane) sums[i] += lanes[i][lane];
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

/// Σ exp(-½ (d / overlap_m)²) over all points, one lane a point of a block.
SCANLOC_SIMD float SumOverlap(const Placed& placed, float overlap_m, const float* __restrict x_m,
                              const float* __restrict y_m, std::size_t num_points) {
  const Placed field = placed;
  const float half_precision = 0.5F / (overlap_m * overlap_m);
  float lanes[kBlock] = {};
  for (std::size_t begin = 0; begin < num_points; begin += kBlock) {
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const float x = x_m[begin + lane];
      const float y = y_m[begin + lane];
      const float distance =
          Sample(field, field.cosine * x - field.sine * y, field.sine * x + field.cosine * y)
              .distance_m();
      lanes[lane] += ExpOfMinus(half_precision * distance * distance);
    }
  }
  float sum = 0.0F;
  for (const float lane : lanes) sum += lane;
  return sum;
}

}  // namespace

PlanarPose Inverse(const PlanarPose& pose) {
  const double cosine = std::cos(pose.yaw_rad);
  const double sine = std::sin(pose.yaw_rad);
  return {-(cosine * pose.x_m + sine * pose.y_m), -(-sine * pose.x_m + cosine * pose.y_m),
          WrapAngle(-pose.yaw_rad)};
}

PlanarPoints::PlanarPoints(std::span<const Post> posts, std::size_t max_points)
    : size_(std::min(posts.size(), max_points)) {
  const std::size_t num_padded = (size_ + kBlock - 1) / kBlock * kBlock;
  x_m_.assign(num_padded, kFarPoint_m);
  y_m_.assign(num_padded, kFarPoint_m);
  for (std::size_t i = 0; i < size_; ++i) {
    const Post& post = posts[i * posts.size() / size_];
    x_m_[i] = static_cast<float>(post.x_cm) * 0.01F;
    y_m_[i] = static_cast<float>(post.y_cm) * 0.01F;
  }
}

DistanceField::DistanceField(double cell_m, double reach_m, double cutoff_m)
    : cell_m_(static_cast<float>(cell_m)),
      cutoff_m_(static_cast<float>(cutoff_m)),
      reach_m_(static_cast<float>(reach_m)),
      side_(static_cast<int>(2.0 * (reach_m + cutoff_m) / cell_m) + 4),
      distance_m_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) + kBlock) {}

SCANLOC_SIMD void DistanceField::Fill(const PlanarPoints& posts) {
  // Squared distances first: every post stamps the cells around it, block by block. What of a block
  // lies beyond the cut-off, or in the next row, changes nothing.
  std::fill(distance_m_.begin(), distance_m_.end(), cutoff_m_ * cutoff_m_);
  const float cell_m = cell_m_;
  const int radius = static_cast<int>(cutoff_m_ / cell_m);
  const float centre = static_cast<float>(side_) / 2.0F;
  for (std::size_t i = 0; i < posts.size(); ++i) {
    if (std::abs(posts.x_m()[i]) > reach_m_ || std::abs(posts.y_m()[i]) > reach_m_) continue;
    const float u = posts.x_m()[i] / cell_m + centre;
    const float v = posts.y_m()[i] / cell_m + centre;
    const int column = static_cast<int>(u) - radius;
    const int row = static_cast<int>(v) - radius;
    for (int begin = column; begin <= column + 2 * radius; begin += static_cast<int>(kBlock)) {
      float dx_squared[kBlock];
      for (std::size_t lane = 0; lane < kBlock; ++lane) {
        const float dx = (static_cast<float>(begin + static_cast<int>(lane)) + 0.5F - u) * cell_m;
        dx_squared[lane] = dx * dx;
      }
      float* cells = distance_m_.data() + static_cast<std::ptrdiff_t>(row) * side_ + begin;
      for (int r = row; r <= row + 2 * radius; ++r, cells += side_) {
        const float dy = (static_cast<float>(r) + 0.5F - v) * cell_m;
        const float dy_squared = dy * dy;
        for (std::size_t lane = 0; lane < kBlock; ++lane) {
          const float squared = dx_squared[lane] + dy_squared;
          cells[lane] = squared < cells[lane] ? squared : cells[lane];
        }
      }
    }
  }
  for (float& cell : distance_m_) cell = __builtin_sqrtf(cell);
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
  for (int i = 0; i < params.num_iterations + params.max_settling; ++i) {
    const double width_m = i < params.num_iterations ? params.wide_m + step_m * i : params.narrow_m;
    Sums sums;
    AddUp(Placed(field, pose), static_cast<float>(width_m), points.x_m().data(),
          points.y_m().data(), points.x_m().size(), sums);
    const Eigen::Vector3d step = Step(sums);
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
  const float sum = SumOverlap(Placed(field, T_field_points), static_cast<float>(overlap_m),
                               points.x_m().data(), points.y_m().data(), points.x_m().size());
  return static_cast<double>(sum) / static_cast<double>(points.size());
}

}  // namespace scanloc
