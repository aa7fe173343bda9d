#include "scanloc/core/scan/pose_covariance.hpp"

#include <Eigen/Eigenvalues>

namespace scanloc {

PoseCovariance Rotated(const Eigen::Matrix3d& R_c_a, const PoseCovariance& covariance) {
  PoseCovariance turn = PoseCovariance::Zero();
  turn.topLeftCorner<3, 3>() = R_c_a;
  turn.bottomRightCorner<3, 3>() = R_c_a;
  const PoseCovariance turned = turn * covariance * turn.transpose();
  return 0.5 * (turned + turned.transpose());
}

PoseCovariance MovedBy(const Eigen::Vector3d& lever_m, const PoseCovariance& covariance) {
  PoseCovariance move = PoseCovariance::Identity();
  // A turn by r moves the far end by r × lever.
  move.topRightCorner<3, 3>() << 0.0, lever_m.z(), -lever_m.y(),  //
      -lever_m.z(), 0.0, lever_m.x(),                             //
      lever_m.y(), -lever_m.x(), 0.0;
  const PoseCovariance moved = move * covariance * move.transpose();
  return 0.5 * (moved + moved.transpose());
}

Eigen::Matrix<double, 6, 1> ErrorOf(const Pose& estimated, const Pose& truth) {
  const Eigen::AngleAxisd turn(estimated.linear() * truth.linear().transpose());
  Eigen::Matrix<double, 6, 1> error;
  error << estimated.translation() - truth.translation(), turn.angle() * turn.axis();
  return error;
}

absl::Status CheckCovariance(const PoseCovariance& covariance) {
  constexpr double kRounding = 1e-9;
  const double size = covariance.cwiseAbs().maxCoeff();
  if (!covariance.allFinite() ||
      (covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kRounding * size) {
    return absl::InvalidArgumentError("a covariance must be finite and symmetric");
  }
  const Eigen::SelfAdjointEigenSolver<PoseCovariance> solver(covariance, Eigen::EigenvaluesOnly);
  if (solver.eigenvalues().minCoeff() >= -kRounding * size) return absl::OkStatus();
  return absl::InvalidArgumentError("a covariance must have no negative eigenvalue");
}

}  // namespace scanloc
