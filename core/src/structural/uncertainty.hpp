#pragma once

#include "scanloc/core/scan/pose_covariance.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "structural/query_match.hpp"

namespace scanloc {

/// How far a registered pose may be off, if it is of the right place: of the query's levelled frame
/// in the place's, for the place that the match has set.
///
/// In the plane and about z by the information of the registration, which knows in which directions
/// nothing holds the pose; height and tilt by the errors of the grounds of both scans. Posts are
/// where cells happen to lie, and see the same walls in the same way: their errors are no more
/// independent than so, and calibrated on simulated drives (docs/algorithm.md, "Covariance").
[[nodiscard]] PoseCovariance CovarianceInLevel(const QueryMatch& match,
                                               const PlanarPose& T_place_query);

}  // namespace scanloc
