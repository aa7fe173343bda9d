#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"

namespace scanloc::slam {

/// That a scan stands so to another, or in the map; it may be wrong.
struct Constraint {
  std::optional<std::size_t> from;                          ///< none: the map
  std::size_t to = 0;                                       ///< not `from`
  Pose T_from_to = Pose::Identity();                        ///< T_map_to where `from` is none
  PoseCovariance information = PoseCovariance::Identity();  ///< inverse covariance of T_from_to
  bool is_trusted = false;                                  ///< never switched off
};

/// How an odometry errs: by chance at every step, and always the same way [each 1σ].
struct OdometryNoise {
  double step_m = 0.008;     ///< of the end of a step of a metre; grows with √length
  double step_rad = 0.0003;  ///< likewise of its turn
  double least_m = 0.001;    ///< of a step at a standstill
  double least_rad = 0.0001;
  double drift_m_m = 0.03;     ///< of what is added to every metre: scale, climb, sideslip
  double drift_rad_m = 0.001;  ///< likewise to its turn about the sensor's z
  /// Likewise to its roll and pitch: little, since loops in the plane hardly see it. It bends all
  /// of a drive into a bowl, which closes as well as a plane does.
  double drift_tilt_rad_m = 1e-5;

  /// Of an odometry that errs so many times as much by chance.
  [[nodiscard]] OdometryNoise Times(double factor_m, double factor_rad) const {
    return {factor_m * step_m, factor_rad * step_rad, factor_m * least_m, factor_rad * least_rad,
            drift_m_m,         drift_rad_m,           drift_tilt_rad_m};
  }
};

/// What an odometry was found to do always, for every metre driven, along and about the sensor's
/// axes.
struct Drift {
  Eigen::Vector3d shift_m_m = Eigen::Vector3d::Zero();  ///< the truth is longer by this
  Eigen::Vector3d turn_rad_m = Eigen::Vector3d::Zero();
};

/// A step of the odometry, T_before_after, with the drift taken out.
[[nodiscard]] Pose WithoutDrift(const Pose& step, const Drift& drift);

/// Of such a step.
[[nodiscard]] PoseCovariance InformationOfStep(const Pose& step, const OdometryNoise& noise);

struct PoseGraph {
  std::vector<Pose> T_odom_scan;  ///< in the order driven
  std::vector<Pose> T_map_scan;   ///< where to begin, one a scan
  std::vector<Constraint> constraints;
};

struct GraphOptions {
  OdometryNoise noise;
  /// A constraint is switched off where its squared error, in its own standard deviations, exceeds
  /// this; above 0. 22.5 is exceeded by one right one in a thousand, were their covariances exact
  /// and independent of each other, which those of one street are not.
  double max_chi2 = 60.0;
  /// Asked between iterations; true ends it with Cancelled. May be null.
  std::function<bool()> is_cancelled = nullptr;
};

struct OptimizedGraph {
  std::vector<Pose> T_map_scan;
  std::vector<double> chi2;  ///< of each constraint: squared error in its standard deviations
  std::vector<bool> is_on;   ///< of each constraint: false: it contradicts the rest
  Drift drift;
  OdometryNoise noise;  ///< as it was found to be
  int num_iterations = 0;

  [[nodiscard]] std::size_t num_on() const;
};

/// The poses that agree best with odometry and constraints, wrong ones among these switched off:
/// graduated non-convexity (Yang et al., RA-L 2020) with truncated least squares, odometry being
/// trusted up to its noise and a drift that is found, too.
///
/// Where no constraint is to the map, the first scan stays where it is. The same graph gives the
/// same poses on one machine. O(iterations · scans) for graphs of streets.
///
/// InvalidArgument: numbers of poses that differ, none, a constraint on a scan that is not there or
/// whose information is not positive definite. Cancelled. Internal: the solver gave up.
[[nodiscard]] absl::StatusOr<OptimizedGraph> Optimize(const PoseGraph& graph,
                                                      const GraphOptions& options = {});

}  // namespace scanloc::slam
