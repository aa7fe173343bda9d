#include "scanloc/core/structural/registration.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "structural/field_sums.hpp"
#include "structural/horizon.hpp"

namespace scanloc {
namespace {

using field_sums::Placed;
using field_sums::Sums;

const field_sums::Kernels& Fastest() {
  static const field_sums::Kernels kFastest = field_sums::All().front();
  return kFastest;
}

Sums SumsOf(const DistanceField& field, const PlanarPoints& points,
            const PlanarPose& T_field_points, double width_m) {
  Sums sums;
  Fastest().add_up(Placed(field, T_field_points), static_cast<float>(width_m), points.x_m().data(),
                   points.y_m().data(), points.x_m().size(), sums);
  return sums;
}

Eigen::Matrix3d HessianOf(const Sums& sums) {
  Eigen::Matrix3d hessian;
  hessian << sums[0], sums[1], sums[2],  //
      sums[1], sums[3], sums[4],         //
      sums[2], sums[4], sums[5];
  return hessian;
}

/// The step that Gauss-Newton takes, in x, y and yaw; drawn weakly to none.
Eigen::Vector3d Step(const Sums& sums) {
  Eigen::Matrix3d hessian = HessianOf(sums);
  // Along a corridor there is nothing to hold a pose: it must not run away for a grain of slope.
  const double held = 1e-3 + 3e-4 * (hessian(0, 0) + hessian(1, 1));
  hessian.diagonal() += Eigen::Vector3d(held, held, 1e-1);
  return hessian.inverse() * Eigen::Vector3d(sums[6], sums[7], sums[8]);
}

/// Times a distance in the field's unit, squared, the exponent of the overlap.
float PrecisionOf(const Placed& field, double overlap_m) {
  const auto units = static_cast<float>(overlap_m) / field.unit_m;
  return 0.5F / (units * units);
}

}  // namespace

PlanarPose Inverse(const PlanarPose& pose) {
  const double cosine = std::cos(pose.yaw_rad);
  const double sine = std::sin(pose.yaw_rad);
  return {-(cosine * pose.x_m + sine * pose.y_m), -(-sine * pose.x_m + cosine * pose.y_m),
          WrapAngle(-pose.yaw_rad)};
}

PlanarPose Register(const DistanceField& field, const PlanarPoints& points, const PlanarPose& guess,
                    const RegistrationParams& params) {
  // Steps smaller than these are noise beside the posts' own centimetres.
  constexpr double kSettled_m = 0.005;
  constexpr double kSettled_rad = 0.0005;
  PlanarPose pose = guess;
  const double step_m = params.num_iterations < 2
                            ? 0.0
                            : (params.narrow_m - params.wide_m) / (params.num_iterations - 1);
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  double share = 1.0;
  for (int i = 0; i < params.num_iterations + params.max_settling; ++i) {
    const double width_m = i < params.num_iterations ? params.wide_m + step_m * i : params.narrow_m;
    Eigen::Vector3d step = Step(SumsOf(field, points, pose, width_m));
    // Within a cell of a post the field is flatter than it should be, and steps go twice too far:
    // without this they would go to and fro for ever.
    if (step.head<2>().dot(last.head<2>()) < 0.0) share *= 0.5;
    step *= share;
    last = step;
    pose.x_m -= step.x();
    pose.y_m -= step.y();
    pose.yaw_rad -= step.z();
    if (i >= params.num_iterations && step.head<2>().norm() < kSettled_m &&
        std::abs(step.z()) < kSettled_rad) {
      break;
    }
  }
  pose.yaw_rad = WrapAngle(pose.yaw_rad);
  return pose;
}

Eigen::Matrix3d Information(const DistanceField& field, const PlanarPoints& points,
                            const PlanarPose& T_field_points, double width_m) {
  return HessianOf(SumsOf(field, points, T_field_points, width_m));
}

double Overlap(const DistanceField& field, const PlanarPoints& points,
               const PlanarPose& T_field_points, double overlap_m) {
  if (points.empty()) return 0.0;
  const Placed placed(field, T_field_points);
  const float sum = Fastest().overlap(placed, PrecisionOf(placed, overlap_m), points.x_m().data(),
                                      points.y_m().data(), points.x_m().size());
  return static_cast<double>(sum) / static_cast<double>(points.size());
}

double OverlapWithin(const Horizon& horizon, const DistanceField& field, const PlanarPoints& points,
                     const PlanarPose& T_field_points, double overlap_m) {
  const Placed placed(field, T_field_points);
  const field_sums::InSight sum = Fastest().overlap_within(
      placed, horizon.reach_squared_m().data(), PrecisionOf(placed, overlap_m), points.x_m().data(),
      points.y_m().data(), points.x_m().size());
  if (sum.num_points == 0) return 0.0;
  return static_cast<double>(sum.overlap) / sum.num_points;
}

}  // namespace scanloc
