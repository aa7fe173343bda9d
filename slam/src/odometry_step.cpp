#include "graph_errors.hpp"
#include "scanloc/slam/pose_graph.hpp"

// What a step of the odometry says, and how far it may be off.

namespace scanloc::slam {

Pose WithoutDrift(const Pose& step, const Drift& drift) {
  const double length_m = step.translation().norm();
  Pose corrected = step;
  corrected.translation() += length_m * drift.shift_m_m;
  corrected.linear() =
      (Eigen::Quaterniond(step.linear()) * Turn<double>(length_m * drift.turn_rad_m))
          .toRotationMatrix();
  return corrected;
}

PoseCovariance InformationOfStep(const Pose& step, const OdometryNoise& noise) {
  const auto [sigma_m, sigma_rad] = SigmasOfStep(step, noise);
  PoseCovariance information = PoseCovariance::Zero();
  information.diagonal().head<3>().setConstant(1.0 / (sigma_m * sigma_m));
  information.diagonal().tail<3>().setConstant(1.0 / (sigma_rad * sigma_rad));
  return information;
}

}  // namespace scanloc::slam
