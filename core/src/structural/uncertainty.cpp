#include "structural/uncertainty.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "scan/bearing.hpp"

namespace scanloc {
namespace {

// Fitted to 2,058 answers in three towns, campuses and forests each; docs/algorithm.md has how
// they do in others.
/// What one post's distance from its like is off by, of the cells that posts are found in.
constexpr double kPostPerCell = 0.23;
/// However many posts there are.
constexpr double kLeastPerCell = 0.052;
constexpr double kLeast_rad = 0.00062;
/// Of a place's size nothing is known to be farther off than this.
constexpr double kMost_m = 3.0;
constexpr double kMost_rad = 0.3;
/// The height and the lean of a level ground that is seen all around as far as it counts: the
/// former of GroundParams::narrow_m, by which kerbs and slopes may differ from its plane.
constexpr double kHeightPerWidth = 0.0157;
constexpr double kTilt_rad = 0.00045;
/// Little ground is as good as a quarter of it, and its lean as one of five times the variance:
/// where walls are near there is a floor.
constexpr double kLeastArea = 0.25;
constexpr double kMostLean = 5.0;
/// Of GroundParams::reach_m, how far around other places are asked.
constexpr double kAskedReach = 0.25;
/// Of how far they are asked, what is higher or lower stands on another level.
constexpr double kSameLevel = 0.2;
/// What a query's ground disagrees by with the place's, of what the places' do so far apart; as
/// if it were farther off by this share of the reach, for at one spot two scans see other parts.
constexpr double kOfPlaces = 0.2;
constexpr double kFartherOff = 0.12;
/// What places disagree by a metre apart where nobody tells, as in hills; with the weight of one
/// at this share of the reach.
constexpr double kUntoldHeight = 0.005;
constexpr double kUntoldTilt_rad = 0.0015;
constexpr double kUntoldAt = 0.08;

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
    : reach_m_(kAskedReach * params.reach_m), farther_off_m_(kFartherOff * params.reach_m) {
  const double untold_m = kUntoldAt * params.reach_m;
  sum_squared_m2_ = untold_m * untold_m;
  sum_of_squares_ = Eigen::Vector3d(kUntoldHeight, kUntoldTilt_rad, kUntoldTilt_rad) * untold_m;
  sum_of_squares_ = sum_of_squares_.cwiseAbs2().eval();
}

void Unevenness::Add(const Pose& T_level_other, double rise_m) {
  const Eigen::Vector3d at = T_level_other.translation();
  const double squared_m2 = at.head<2>().squaredNorm();
  const double higher_m = at.z() - rise_m;
  if (squared_m2 >= reach_m_ * reach_m_ || std::abs(higher_m) >= kSameLevel * reach_m_) return;
  const Eigen::Vector3d up = T_level_other.linear().col(2);
  sum_squared_m2_ += squared_m2;
  sum_of_squares_ += Eigen::Vector3d(higher_m, up.y(), up.x()).cwiseAbs2();
}

Eigen::Vector3d Unevenness::VarianceAt(double distance_m) const {
  const double squared_m2 = distance_m * distance_m + farther_off_m_ * farther_off_m_;
  return kOfPlaces * squared_m2 / sum_squared_m2_ * sum_of_squares_;
}

PoseCovariance CovarianceInLevel(const QueryMatch& match, const Structure& query,
                                 const Structure& place, const PlanarPose& T_place_query,
                                 const Unevenness& unevenness) {
  const AutoParams& params = match.params();
  const double least_m = kLeastPerCell * params.posts.cell_m;
  const Eigen::Vector3d most(kMost_m, kMost_m, kMost_rad);
  const Eigen::Vector3d least(least_m, least_m, kLeast_rad);
  const double post_m = kPostPerCell * params.posts.cell_m;
  Eigen::Matrix3d information = match.Information(T_place_query) / (post_m * post_m);
  information.diagonal() += most.cwiseProduct(most).cwiseInverse();
  Eigen::Matrix3d planar = information.inverse();
  planar.diagonal() += least.cwiseProduct(least);

  PoseCovariance covariance = PoseCovariance::Zero();
  covariance.topLeftCorner<2, 2>() = planar.topLeftCorner<2, 2>();
  covariance.block<2, 1>(0, 5) = planar.block<2, 1>(0, 2);
  covariance.block<1, 2>(5, 0) = planar.block<1, 2>(2, 0);
  covariance(5, 5) = planar(2, 2);

  const double reach_m = params.ground.reach_m;
  const Eigen::Vector3d seen = 0.5 * (VarianceOfSeen(place.posts, 0.0, reach_m) +
                                      VarianceOfSeen(query.posts, T_place_query.yaw_rad, reach_m));
  const Eigen::Vector3d level(kHeightPerWidth * params.ground.narrow_m, kTilt_rad, kTilt_rad);
  covariance.diagonal().segment<3>(2) =
      level.cwiseAbs2().cwiseProduct(seen) +
      unevenness.VarianceAt(std::hypot(T_place_query.x_m, T_place_query.y_m));
  return covariance;
}

}  // namespace scanloc
