#include "structural/uncertainty.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace scanloc {
namespace {

Pose At(double x_m, double z_m, double roll_rad) {
  Pose pose = Pose::Identity();
  pose.translate(Eigen::Vector3d(x_m, 0.0, z_m));
  pose.rotate(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()));
  return pose;
}

TEST(Unevenness, IsWhatThePlacesAroundDisagreeBy) {
  Unevenness level{GroundParams()}, uneven{GroundParams()};
  for (const double x_m : {-4.0, -2.0, 2.0, 4.0}) {
    level.Add(At(x_m, 0.1, 0.0), 0.1);  // a sensor 0.1 m higher above a ground that goes on
    uneven.Add(At(x_m, 0.02 * std::abs(x_m) + 0.1, 0.005 * x_m), 0.1);
  }
  const Eigen::Vector3d ratio = uneven.VarianceAt(1.0).cwiseQuotient(level.VarianceAt(1.0));
  EXPECT_GT(ratio[0], 100.0) << "height";
  EXPECT_GT(ratio[1], 50.0) << "roll";
  EXPECT_NEAR(ratio[2], 1.0, 1e-9) << "pitch";
  EXPECT_GT(uneven.VarianceAt(5.0)[1], uneven.VarianceAt(1.0)[1]);
}

TEST(Unevenness, HearsNobodyFarOffOrOnAnotherLevel) {
  Unevenness alone{GroundParams()}, among{GroundParams()};
  among.Add(At(0.5 * GroundParams().reach_m, 0.3, 0.1), 0.0);
  among.Add(At(1.0, 3.0, 0.1), 0.0);
  among.Add(At(1.0, -3.0, 0.1), 0.0);
  EXPECT_EQ(among.VarianceAt(1.0), alone.VarianceAt(1.0));
  EXPECT_GT(alone.VarianceAt(0.0).minCoeff(), 0.0) << "where nobody tells";
}

}  // namespace
}  // namespace scanloc
