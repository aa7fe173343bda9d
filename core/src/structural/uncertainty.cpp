#include "structural/uncertainty.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "scan/bearing.hpp"

namespace scanloc {
namespace {

// Fitted to simulated drives in towns, on campuses, in forests on hills, and indoors at a scale of
// 0.35; docs/algorithm.md has how they do in others.
/// What one post's distance from its like is off by, of the cells that posts are found in ...
constexpr double kPostPerCell = 0.5;
/// ... and what all of them are together, however many there are: walls are where cells lie.
constexpr double kAllPerCell = 0.025;
/// Of a place's size nothing is known to be farther off than this.
constexpr double kMost_m = 3.0;
constexpr double kMost_rad = 0.3;
/// The height and the lean of a level ground that is seen all around as far as it counts: by
/// GroundParams::narrow_m, by which kerbs and slopes may differ from its plane. Floors are flatter
/// than streets by more than they are smaller.
constexpr double kHeightPerWidth = 0.0157;
constexpr double kTiltPerSquaredWidth = 0.0039;  // [rad/m²]
/// Little ground is as good as a quarter of it, and its lean as one of five times the variance:
/// where walls are near there is a floor.
constexpr double kLeastArea = 0.25;
constexpr double kMostLean = 5.0;
/// Of GroundParams::reach_m, how far around other places are asked.
constexpr double kAskedReach = 0.25;
/// Of how far they are asked, what is higher or lower stands on another level.
constexpr double kSameLevel = 0.2;
/// At one spot two scans see other parts, as if they were farther apart by this share of the reach.
constexpr double kFartherOff = 0.12;
/// What places disagree by a metre apart where nobody tells, as in hills; with this weight of one
/// that does.
constexpr double kUntoldHeight = 0.003;
constexpr double kUntoldTilt_rad = 0.0008;
constexpr double kUntoldWeight = 0.2;

/// The variances of height, roll and pitch of a ground seen from its middle to the first post in
/// each direction, of those of a whole disc: the fewer cells and the less far out, the more. The
/// cells' errors are alike, so that these grow with the square of what independent ones' would.
Eigen::Vector3d VarianceOfSeen(std::span<const Post> posts, double yaw_rad, double reach_m) {
  constexpr int kNumSectors = 180;
  constexpr double kSector_rad = 2.0 * std::numbers::pi / kNumSectors;
  std::array<double, kNumSectors> near{};
  near.fill(1.0);
  for (const Post& post : posts) {
    const auto sector = static_cast<std::size_t>(
        SectorFromRear(static_cast<float>(post.x_cm), static_cast<float>(post.y_cm), kNumSectors));
    near[sector] = std::min(near[sector], std::hypot(post.x_cm, post.y_cm) / (100.0 * reach_m));
  }
  double area = 0.0;
  Eigen::Matrix2d moment = Eigen::Matrix2d::Identity() * 1e-6;  // of a whole disc: the identity
  for (int i = 0; i < kNumSectors; ++i) {
    const double range = near[static_cast<std::size_t>(i)];
    const double azimuth_rad = yaw_rad - std::numbers::pi + (i + 0.5) * kSector_rad;
    const Eigen::Vector2d held(std::sin(azimuth_rad), -std::cos(azimuth_rad));
    area += range * range / kNumSectors;
    moment += 2.0 / kNumSectors * std::pow(range, 4) * held * held.transpose();
  }
  const Eigen::Vector2d lean = moment.inverse().diagonal().cwiseMin(kMostLean);
  const double height = 1.0 / std::max(area, kLeastArea);
  return {height * height, lean.x() * lean.x(), lean.y() * lean.y()};
}

}  // namespace

Unevenness::Unevenness(const GroundParams& params)
    : reach_m_(kAskedReach * params.reach_m),
      farther_off_m_(kFartherOff * params.reach_m),
      weight_(kUntoldWeight),
      sum_(Eigen::Vector3d(kUntoldHeight, kUntoldTilt_rad, kUntoldTilt_rad).cwiseAbs2() *
           kUntoldWeight) {}

double Unevenness::Squared(double distance_m) const {
  return distance_m * distance_m + farther_off_m_ * farther_off_m_;
}

void Unevenness::Add(const Pose& T_level_other, double rise_m) {
  const Eigen::Vector3d at = T_level_other.translation();
  const double distance_m = at.head<2>().norm();
  const double higher_m = at.z() - rise_m;
  if (distance_m >= reach_m_ || std::abs(higher_m) >= kSameLevel * reach_m_) return;
  const Eigen::Vector3d up = T_level_other.linear().col(2);
  weight_ += 1.0;
  sum_ += Eigen::Vector3d(higher_m, up.y(), up.x()).cwiseAbs2() / Squared(distance_m);
}

Eigen::Vector3d Unevenness::VarianceAt(double distance_m) const {
  return Squared(distance_m) / weight_ * sum_;
}

PoseCovariance CovarianceInLevel(const QueryMatch& match, const Structure& query,
                                 const Structure& place, const PlanarPose& T_place_query,
                                 const Unevenness& unevenness) {
  const AutoParams& params = match.params();
  const Eigen::Vector3d most(kMost_m, kMost_m, kMost_rad);
  Eigen::Matrix3d information = match.Information(T_place_query);
  const double num_posts = 0.5 * (information(0, 0) + information(1, 1));
  const double cells = kPostPerCell * kPostPerCell + kAllPerCell * kAllPerCell * num_posts;
  information /= cells * params.posts.cell_m * params.posts.cell_m;
  information.diagonal() += most.cwiseProduct(most).cwiseInverse();
  const Eigen::Matrix3d planar = information.inverse();

  PoseCovariance covariance = PoseCovariance::Zero();
  covariance.topLeftCorner<2, 2>() = planar.topLeftCorner<2, 2>();
  covariance.block<2, 1>(0, 5) = planar.block<2, 1>(0, 2);
  covariance.block<1, 2>(5, 0) = planar.block<1, 2>(2, 0);
  covariance(5, 5) = planar(2, 2);

  const double reach_m = params.ground.reach_m;
  const Eigen::Vector3d seen = 0.5 * (VarianceOfSeen(place.posts, 0.0, reach_m) +
                                      VarianceOfSeen(query.posts, T_place_query.yaw_rad, reach_m));
  const double width_m = params.ground.narrow_m;
  const double tilt_rad = kTiltPerSquaredWidth * width_m * width_m;
  const Eigen::Vector3d level(kHeightPerWidth * width_m, tilt_rad, tilt_rad);
  covariance.diagonal().segment<3>(2) =
      level.cwiseAbs2().cwiseProduct(seen) +
      unevenness.VarianceAt(std::hypot(T_place_query.x_m, T_place_query.y_m));
  return covariance;
}

}  // namespace scanloc
