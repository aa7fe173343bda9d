#include "scanloc/core/scan/pose_difference.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace scanloc {

PoseDifference DifferenceOf(const Pose& a, const Pose& b, const Eigen::Vector3d& up) {
  const Eigen::Vector3d off_m = a.translation() - b.translation();
  const double rise_m = up.dot(off_m);
  const Eigen::Quaterniond turn(a.linear() * b.linear().transpose());
  const double heading_rad = WrapAngle(2.0 * std::atan2(up.dot(turn.vec()), turn.w()));
  return {(off_m - rise_m * up).norm(), std::abs(rise_m),
          std::abs(heading_rad) * 180.0 / std::numbers::pi};
}

PoseMiss MissOf(const PoseDifference& difference, const PoseLimits& limits) {
  return {!(difference.plane_m <= limits.plane_m), !(difference.height_m <= limits.height_m),
          !(difference.heading_deg <= limits.heading_deg)};
}

}  // namespace scanloc
