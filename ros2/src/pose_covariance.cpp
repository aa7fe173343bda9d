#include "pose_covariance.hpp"

#include <cstddef>
#include <numbers>

namespace scanloc::ros2 {

Covariance CovarianceOf(const Candidate& /*candidate*/) {
  constexpr double kDeviation_m = 0.5;
  constexpr double kDeviation_rad = 5.0 * std::numbers::pi / 180.0;
  Covariance covariance{};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double deviation = axis < 3 ? kDeviation_m : kDeviation_rad;
    covariance[axis * 7] = deviation * deviation;
  }
  return covariance;
}

}  // namespace scanloc::ros2
