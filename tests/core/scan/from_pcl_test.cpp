#include <gtest/gtest.h>
#include <pcl/point_types.h>

#include "scanloc/pcl/point_cloud.hpp"

namespace scanloc {
namespace {

TEST(FromPcl, TakesXyzOfAnyPointType) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  cloud.emplace_back(1.0F, 2.0F, 3.0F, 0.5F);
  cloud.emplace_back(-4.0F, 5.0F, -6.0F, 0.0F);
  EXPECT_EQ(FromPcl(cloud), PointCloud({{1, 2, 3}, {-4, 5, -6}}));
  EXPECT_TRUE(FromPcl(pcl::PointCloud<pcl::PointXYZ>()).empty());
}

}  // namespace
}  // namespace scanloc
