#pragma once

#include <Eigen/Core>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "structural/query_match.hpp"

namespace scanloc {

/// How uneven the ground around a place is, as the places around tell: their poses are known, so
/// that what two grounds laid on each other are off by is seen, as a query's will be.
class Unevenness {
 public:
  explicit Unevenness(const GroundParams& params);

  /// How far around the place others say anything of its ground [m].
  [[nodiscard]] double reach_m() const { return reach_m_; }
  /// Takes in another place's levelled frame in that of the place, and how much higher its sensor
  /// stands above its ground. One that is not within reach_m(), or on another level, says nothing.
  void Add(const Pose& T_level_other, double rise_m);

  /// What grounds so far from each other disagree by: in height [m²], and in how they lean about
  /// the x and y axes of the place's levelled frame [rad²].
  [[nodiscard]] Eigen::Vector3d VarianceAt(double distance_m) const;

 private:
  [[nodiscard]] double Squared(double distance_m) const;

  double reach_m_, farther_off_m_;
  double weight_;        ///< how many tell
  Eigen::Vector3d sum_;  ///< of what they disagree by, squared, a squared metre
};

/// How far a registered pose may be off, if it is of the right place: of the query's levelled frame
/// in the place's, for the place that the match has set.
///
/// In the plane and about z by the information of the registration, which knows in which directions
/// nothing holds the pose. Height and tilt by how much of the ground both scans see before
/// something upright stands in the way, and by how uneven it is around the place. Posts are where
/// cells happen to lie, and see the same walls in the same way: their errors are no more
/// independent than so, and calibrated on simulated drives (docs/algorithm.md, "Covariance").
[[nodiscard]] PoseCovariance CovarianceInLevel(const QueryMatch& match, const Structure& query,
                                               const Structure& place,
                                               const PlanarPose& T_place_query,
                                               const Unevenness& unevenness);

}  // namespace scanloc
