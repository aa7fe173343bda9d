#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scanloc/core/structural/registration.hpp"

// What registration adds up over points that are laid on a distance field. Of each eight points one
// goes to each of eight sums, which are added up at the end: the same bits on any processor.

namespace scanloc {

namespace field_sums {

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

/// What the normal equations are made of: the six different elements of Σ w·J·Jᵀ, and Σ w·d·J.
constexpr std::size_t kNumSums = 9;
using Sums = std::array<float, kNumSums>;

struct InSight {
  float overlap = 0.0F;
  int num_points = 0;
};

/// One way of adding up, for some processors. Of points, whole blocks.
struct Kernels {
  const char* name;
  /// With Geman-McClure weights of a width.
  void (*add_up)(const Placed& field, float width_m, const float* x_m, const float* y_m,
                 std::size_t num_points, Sums& sums);
  /// Σ exp(-precision · distance²), the distance in the field's unit.
  float (*overlap)(const Placed& field, float precision, const float* x_m, const float* y_m,
                   std::size_t num_points);
  /// The same over the points within a horizon about the field's origin; and how many these are.
  InSight (*overlap_within)(const Placed& field, const float* reach_squared_m, float precision,
                            const float* x_m, const float* y_m, std::size_t num_points);
};

/// All that this processor has, the fastest first; all give the same bits.
[[nodiscard]] std::vector<Kernels> All();

#ifdef __x86_64__
extern const Kernels kAvx512;
#endif

/// exp(-x) for x in [0, 87], to 2e-6 of it: a power of two by its bits, the rest, in (0, 1], by a
/// polynomial. Not std::exp, so that loops over it become vectors.
inline constexpr float kOctaves = -1.44269504F;
inline constexpr std::array<float, 6> kPowerOfTwo = {1.0F,       0.693147F,  0.240227F,
                                                     0.0555044F, 0.0096181F, 0.0015025F};

}  // namespace field_sums
}  // namespace scanloc
