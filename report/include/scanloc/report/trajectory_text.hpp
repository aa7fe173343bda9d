#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scanloc/core/scan/pose.hpp"

namespace scanloc::report {

/// One pose a row: [R t] row by row, with the digits that give the same bits again.
[[nodiscard]] std::string PosesAsKitti(const std::vector<Pose>& poses);

/// `stamp x y z qx qy qz qw` with a line end; the stamp in seconds, without the rounding of a
/// double.
[[nodiscard]] std::string TumRow(std::int64_t stamp_ns, const Pose& pose);
/// One stamp a pose.
[[nodiscard]] std::string PosesAsTum(const std::vector<std::int64_t>& stamps_ns,
                                     const std::vector<Pose>& poses);

/// That pose `to` stands so to pose `from`.
struct GraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose T_from_to = Pose::Identity();
  /// Inverse of its PoseCovariance.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
};

/// VERTEX_SE3:QUAT, the first FIXed, and EDGE_SE3:QUAT, whose information is of the translation and
/// the imaginary part of the quaternion along the axes of `to`, as g2o has it.
[[nodiscard]] std::string GraphAsG2o(const std::vector<Pose>& poses,
                                     const std::vector<GraphEdge>& edges);

}  // namespace scanloc::report
