#include "track/reckoned_pose.hpp"

#include <cmath>
#include <numbers>

#include "scanloc/core/scan/pose_difference.hpp"

namespace scanloc {
namespace {

constexpr double kUsualDeviations = 3.0;  // what is farther off is weighed less

Eigen::Quaterniond PartOf(const Eigen::Quaterniond& turn, double share) {
  return Eigen::Quaterniond::Identity().slerp(share, turn);
}

}  // namespace

void ReckonedPose::Move(const Pose& T_last_scan) {
  T_map_scan_ = T_map_scan_ * T_last_scan;
  unseen_m_ += T_last_scan.translation().norm();
}

double ReckonedPose::Gain(const Noise& noise, double off, double worse, double& variance) const {
  const double reckoned = noise.at_once + noise.per_metre * unseen_m_;
  variance += reckoned * reckoned;
  double found_variance = noise.found * noise.found * worse * worse;
  const double deviations = off / std::sqrt(variance + found_variance);
  if (deviations > kUsualDeviations) {
    found_variance *= std::pow(deviations / kUsualDeviations, 2);
  }
  const double gain = variance / (variance + found_variance);
  variance *= 1.0 - gain;
  return gain;
}

void ReckonedPose::Correct(const Pose& T_map_found, double worse, bool reckons_height,
                           const Eigen::Vector3d& up) {
  const PoseDifference off = DifferenceOf(T_map_found, T_map_scan_, up);
  // The turn between the two: first one about up, then one that tilts.
  const Eigen::Quaterniond reckoned(T_map_scan_.linear());
  const Eigen::Quaterniond turn = Eigen::Quaterniond(T_map_found.linear()) * reckoned.conjugate();
  Eigen::Quaterniond about_up(turn.w(), 0.0, 0.0, 0.0);
  about_up.vec() = turn.vec().dot(up) * up;
  about_up.normalize();
  const Eigen::Quaterniond tilting = turn * about_up.conjugate();
  const double tilt_deg =
      tilting.angularDistance(Eigen::Quaterniond::Identity()) * 180.0 / std::numbers::pi;

  const double plane = Gain(kPlane_m, off.plane_m, worse, plane_variance_);
  const double heading = Gain(kHeading_deg, off.heading_deg, worse, heading_variance_);
  const double height =
      reckons_height ? Gain(kHeight_m, off.height_m, worse, height_variance_) : 1.0;
  const double tilt = reckons_height ? Gain(kTilt_deg, tilt_deg, worse, tilt_variance_) : 1.0;
  const Eigen::Vector3d way = T_map_found.translation() - T_map_scan_.translation();
  const Eigen::Vector3d rise = way.dot(up) * up;
  T_map_scan_.translation() += plane * (way - rise) + height * rise;
  T_map_scan_.linear() = (PartOf(tilting, tilt) * PartOf(about_up, heading) * reckoned)
                             .normalized()
                             .toRotationMatrix();
  unseen_m_ = 0.0;
}

bool ReckonedPose::IsFarFrom(const Pose& T_map_found, const Eigen::Vector3d& up) const {
  // Some half of the limits of a right pose: beyond, one of the two is soon not right.
  constexpr PoseLimits kFar = {.plane_m = 0.6, .height_m = 1.0, .heading_deg = 5.0};
  return MissOf(DifferenceOf(T_map_found, T_map_scan_, up), kFar).any();
}

bool ReckonsHeight(const Pose& T_last_scan) {
  constexpr double kRounding = 1e-5;
  return std::abs(T_last_scan.translation().z()) > kRounding ||
         T_last_scan.linear().col(2).head<2>().norm() > kRounding;
}

}  // namespace scanloc
