#include "scanloc/core/scan/pose.hpp"

#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

constexpr double kRotationTolerance = 1e-3;
constexpr double kQuaternionTolerance = 1e-2;

absl::Status CheckTranslation(const Eigen::Vector3d& t) {
  if (!t.allFinite() || t.cwiseAbs().maxCoeff() > limits::kMaxTranslation_m) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "translation (%g, %g, %g) m is not a finite position within ±%g m of the origin", t.x(),
        t.y(), t.z(), limits::kMaxTranslation_m));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Pose> PoseFromMatrix(const Eigen::Matrix<double, 3, 4>& matrix) {
  if (absl::Status status = CheckTranslation(matrix.col(3)); !status.ok()) return status;
  const Eigen::Matrix3d r = matrix.leftCols<3>();
  if (!r.allFinite())
    return absl::InvalidArgumentError("rotation has an element that is not finite");
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kRotationTolerance || r.determinant() < 0.0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("not a rotation: |RᵀR - I| is %.3g (at most %g allowed) and det R is %.3g",
                        error, kRotationTolerance, r.determinant()));
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose pose = Pose::Identity();
  pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  pose.translation() = matrix.col(3);
  return pose;
}

absl::StatusOr<Pose> PoseFromQuaternion(const Eigen::Vector3d& translation_m,
                                        const Eigen::Quaterniond& rotation) {
  if (absl::Status status = CheckTranslation(translation_m); !status.ok()) return status;
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= kQuaternionTolerance)) {  // also refuses NaN
    return absl::InvalidArgumentError(absl::StrFormat(
        "quaternion has norm %g; a rotation has norm 1 (±%g)", norm, kQuaternionTolerance));
  }
  Pose pose = Pose::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = translation_m;
  return pose;
}

Pose PlanarOffset(double lateral_m, double yaw_rad) {
  Pose offset = Pose::Identity();
  offset.translate(Eigen::Vector3d(0.0, lateral_m, 0.0));
  offset.rotate(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  return offset;
}

double Yaw(const Pose& pose) {
  return WrapAngle(std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)));
}

double WrapAngle(double angle_rad) {
  // Mostly there is nothing to do.
  if (angle_rad > -std::numbers::pi && angle_rad <= std::numbers::pi) return angle_rad;
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

}  // namespace scanloc
