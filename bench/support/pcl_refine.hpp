#pragma once

#include <string>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

/// Registration by PCL, behind an interface without it.
namespace scanloc::bench {

enum class Refiner { kIcp, kGicp };

struct Refined {
  Pose T_target_source = Pose::Identity();
  bool has_converged = false;
  int num_iterations = 0;
  double rmse_m = 0.0;  ///< of the source's points from the nearest of the target's
};

/// What stops it.
struct RefineLimits {
  int most_iterations = 100;
  double farthest_pair_m = 5.0;
};

/// Lays the source on the target from where the guess puts it. Requires finite points; of too few
/// nothing converges.
[[nodiscard]] Refined Refine(Refiner refiner, PointView source, PointView target,
                             const Pose& T_target_guess, const RefineLimits& limits);

}  // namespace scanloc::bench
