#include "structural/uncertainty.hpp"

#include <cmath>

namespace scanloc {
namespace {

// Fitted to 287 answers in towns, a campus and a forest; tests/sim/covariance_test.cpp measures
// them in others.
/// What one post's distance from its like is off by, of the cells that posts are found in.
constexpr double kPostPerCell = 0.55;
/// However many posts there are.
constexpr double kLeast_m = 0.03;
constexpr double kLeast_rad = 0.0012;
/// Of a place's size nothing is known to be farther off than this.
constexpr double kMost_m = 3.0;
constexpr double kMost_rad = 0.3;
/// Of two grounds laid on each other: their heights below the sensors, and how they lean.
constexpr double kHeight_m = 0.015;
constexpr double kTilt_rad = 0.0028;

}  // namespace

PoseCovariance CovarianceInLevel(const QueryMatch& match, const PlanarPose& T_place_query) {
  const Eigen::Vector3d most(kMost_m, kMost_m, kMost_rad);
  const Eigen::Vector3d least(kLeast_m, kLeast_m, kLeast_rad);
  const double post_m = kPostPerCell * match.params().posts.cell_m;
  Eigen::Matrix3d information = match.Information(T_place_query) / (post_m * post_m);
  information.diagonal() += most.cwiseProduct(most).cwiseInverse();
  Eigen::Matrix3d planar = information.inverse();
  planar.diagonal() += least.cwiseProduct(least);

  PoseCovariance covariance = PoseCovariance::Zero();
  covariance.topLeftCorner<2, 2>() = planar.topLeftCorner<2, 2>();
  covariance.block<2, 1>(0, 5) = planar.block<2, 1>(0, 2);
  covariance.block<1, 2>(5, 0) = planar.block<1, 2>(2, 0);
  covariance(5, 5) = planar(2, 2);
  // The place's ground leans under the query, too.
  const double rise_m = kTilt_rad * std::hypot(T_place_query.x_m, T_place_query.y_m);
  covariance(2, 2) = kHeight_m * kHeight_m + rise_m * rise_m;
  covariance(3, 3) = covariance(4, 4) = kTilt_rad * kTilt_rad;
  return covariance;
}

}  // namespace scanloc
