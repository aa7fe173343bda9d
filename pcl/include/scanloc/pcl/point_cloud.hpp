#pragma once

#include <pcl/point_cloud.h>

#include "scanloc/core/scan/point_cloud.hpp"

/// For those who have their scans as PCL clouds. The only header that includes PCL's; it links none
/// of its libraries.
namespace scanloc {

/// x y z of every point [m], in order; of any point type that has them. Points that are not finite
/// are kept: it is the Describer that skips and counts them.
template <typename PointT>
[[nodiscard]] PointCloud FromPcl(const pcl::PointCloud<PointT>& cloud) {
  PointCloud points;
  points.reserve(cloud.size());
  for (const PointT& point : cloud) points.push_back({point.x, point.y, point.z});
  return points;
}

}  // namespace scanloc
