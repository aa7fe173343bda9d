#pragma once

#include <cstddef>
#include <span>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::eval {

/// Of the lengths of many errors.
struct ErrorStatistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
  std::size_t num = 0;
};

/// How far a trajectory is from the true one, in the terms of the Python package evo.
struct TrajectoryErrors {
  Pose T_truth_estimate = Pose::Identity();  ///< lays the estimate on the truth, by Umeyama
  ErrorStatistics ape_m;                     ///< of positions, so laid: evo_ape --align
  ErrorStatistics ape_deg;                   ///< of rotations: with --pose_relation angle_deg
  ErrorStatistics rpe_m;                     ///< of the motion between neighbours: evo_rpe
  ErrorStatistics rpe_deg;
  /// Over 100 m of the true way, a stretch behind the other: evo_rpe --delta 100 --delta_unit m
  /// --pairs_from_reference; none of a shorter drive.
  ErrorStatistics rpe_100m_m;
};

/// InvalidArgument: numbers of poses that differ, or fewer than 2.
[[nodiscard]] absl::StatusOr<TrajectoryErrors> CompareTrajectories(std::span<const Pose> truth,
                                                                   std::span<const Pose> estimate);

}  // namespace scanloc::eval
