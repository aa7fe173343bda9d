#pragma once

#include <Eigen/Core>

#include "scanloc/core/scan/pose.hpp"

/// What makes two poses the same, and an answer right. Pure functions; thread-safe.
namespace scanloc {

/// How two poses of one frame differ, as seen by who stands upright in it.
struct PoseDifference {
  double plane_m = 0.0;      ///< across the up direction
  double height_m = 0.0;     ///< along it
  double heading_deg = 0.0;  ///< by which one has to be turned about it, in [0, 180]
};

/// `up` is a unit vector of the frame in which the poses are told. The heading is right for any
/// mount of the sensor: it is that of the turn between the poses, not of one of the sensor's axes.
[[nodiscard]] PoseDifference DifferenceOf(const Pose& a, const Pose& b,
                                          const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

/// Poses that differ by more than this in any of the three are not the same: a robot would stand
/// elsewhere, on another floor or look another way.
struct PoseLimits {
  double plane_m = 1.0;
  double height_m = 1.0;
  double heading_deg = 10.0;
};

/// Which of the three limits a difference exceeds.
struct PoseMiss {
  bool plane = false;
  bool height = false;
  bool heading = false;

  [[nodiscard]] bool any() const { return plane || height || heading; }
};
/// What is not finite exceeds every limit.
[[nodiscard]] PoseMiss MissOf(const PoseDifference& difference, const PoseLimits& limits = {});

}  // namespace scanloc
