#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "scanloc/slam/pose_graph.hpp"

// What Ceres makes small: the errors of steps, constraints and drift, by their own deviations.

namespace scanloc::slam {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Standard deviations of a step: of its end and of its turn.
inline std::pair<double, double> SigmasOfStep(const Pose& step, const OdometryNoise& noise) {
  const double root_length = std::sqrt(step.translation().norm());
  return {std::hypot(noise.least_m, noise.step_m * root_length),
          std::hypot(noise.least_rad, noise.step_rad * root_length)};
}

/// Axis times angle.
template <typename T>
Eigen::Matrix<T, 3, 1> RotationVector(Eigen::Quaternion<T> q) {
  if (q.w() < T(0.0)) q.coeffs() = -q.coeffs();
  const T sin_squared = q.vec().squaredNorm();
  if (sin_squared < T(1e-20)) return T(2.0) * q.vec();
  const T sin_half = sqrt(sin_squared);
  return (T(2.0) * atan2(sin_half, q.w()) / sin_half) * q.vec();
}

/// The turn about a vector by its length, where that is small.
template <typename T>
Eigen::Quaternion<T> Turn(const Eigen::Matrix<T, 3, 1>& vector) {
  // Of a small angle: exact enough, and smooth at zero.
  Eigen::Quaternion<T> q(T(1.0), vector.x() * T(0.5), vector.y() * T(0.5), vector.z() * T(0.5));
  q.normalize();
  return q;
}

/// Position along the axes of `from`, then the turn about them, as PoseCovariance has it.
template <typename T>
Eigen::Matrix<T, 6, 1> Error(const Eigen::Quaternion<T>& q, const Eigen::Matrix<T, 3, 1>& t,
                             const Eigen::Quaternion<T>& q_told,
                             const Eigen::Matrix<T, 3, 1>& t_told) {
  Eigen::Matrix<T, 6, 1> error;
  error.template head<3>() = t - t_told;
  error.template tail<3>() = RotationVector<T>(q * q_told.conjugate());
  return error;
}

/// An odometry step, with the drift taken out.
class StepError {
 public:
  StepError(const Pose& step, double sigma_m, double sigma_rad)
      : q_(step.linear()),
        t_(step.translation()),
        length_m_(step.translation().norm()),
        per_m_(1.0 / sigma_m),
        per_rad_(1.0 / sigma_rad) {}

  template <typename T>
  bool operator()(const T* q_a, const T* t_a, const T* q_b, const T* t_b, const T* drift,
                  T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Eigen::Quaternion<T>> qa(q_a);
    const Eigen::Map<const Eigen::Quaternion<T>> qb(q_b);
    const Eigen::Map<const Vector> ta(t_a);
    const Eigen::Map<const Vector> tb(t_b);
    const Eigen::Map<const Vector> shift(drift);
    const Eigen::Map<const Vector> turn(drift + 3);
    const Vector told = t_.template cast<T>() + T(length_m_) * shift;
    const Eigen::Quaternion<T> q_told =
        q_.template cast<T>() * Turn<T>(Vector(T(length_m_) * turn));
    Eigen::Map<Eigen::Matrix<T, 6, 1>> error(residual);
    error = Error<T>(qa.conjugate() * qb, qa.conjugate() * (tb - ta), q_told, told);
    error.template head<3>() *= T(per_m_);
    error.template tail<3>() *= T(per_rad_);
    return true;
  }

 private:
  Eigen::Quaterniond q_;
  Eigen::Vector3d t_;
  double length_m_;
  double per_m_;
  double per_rad_;
};

/// A constraint between two scans, or on one, as far as it is switched on.
class ConstraintError {
 public:
  ConstraintError(const Constraint& constraint, const Matrix6& root, const double* weight)
      : q_(constraint.T_from_to.linear()),
        t_(constraint.T_from_to.translation()),
        root_(root),
        weight_(weight) {}

  template <typename T>
  bool operator()(const T* q_a, const T* t_a, const T* q_b, const T* t_b, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> qa(q_a);
    const Eigen::Map<const Eigen::Quaternion<T>> qb(q_b);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> ta(t_a);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> tb(t_b);
    return Weigh<T>(qa.conjugate() * qb, qa.conjugate() * (tb - ta), residual);
  }

  template <typename T>
  bool operator()(const T* q, const T* t, T* residual) const {
    return Weigh<T>(Eigen::Map<const Eigen::Quaternion<T>>(q),
                    Eigen::Map<const Eigen::Matrix<T, 3, 1>>(t), residual);
  }

 private:
  template <typename T>
  bool Weigh(const Eigen::Quaternion<T>& q, const Eigen::Matrix<T, 3, 1>& t, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 6, 1>> error(residual);
    error = (std::sqrt(*weight_) * root_).template cast<T>() *
            Error<T>(q, t, q_.template cast<T>(), t_.template cast<T>());
    return true;
  }

  Eigen::Quaterniond q_;
  Eigen::Vector3d t_;
  Matrix6 root_;  // √information
  const double* weight_;
};

/// What is believed of the drift before anything was seen.
class DriftError {
 public:
  explicit DriftError(const OdometryNoise& noise)
      : per_m_(1.0 / noise.drift_m_m),
        per_tilt_rad_(1.0 / noise.drift_tilt_rad_m),
        per_turn_rad_(1.0 / noise.drift_rad_m) {}

  template <typename T>
  bool operator()(const T* drift, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = drift[i] * T(per_m_);
    for (int i = 3; i < 5; ++i) residual[i] = drift[i] * T(per_tilt_rad_);
    residual[5] = drift[5] * T(per_turn_rad_);
    return true;
  }

 private:
  double per_m_;
  double per_tilt_rad_;
  double per_turn_rad_;
};

}  // namespace scanloc::slam
