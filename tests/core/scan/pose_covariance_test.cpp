#include "scanloc/core/scan/pose_covariance.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace scanloc {
namespace {

Pose PoseOf(const Eigen::Vector3d& at, const Eigen::Vector3d& turn) {
  Pose pose(Eigen::Translation3d(at.x(), at.y(), at.z()));
  if (turn.norm() > 0.0) pose.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  return pose;
}

/// Poses that differ from one by errors of a covariance, and the covariance of what a function
/// makes of them.
template <typename Make>
PoseCovariance Sampled(const PoseCovariance& covariance, const Pose& T_a_b, Make&& make) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const PoseCovariance root = covariance.llt().matrixL();
  constexpr int kNumSamples = 20'000;
  PoseCovariance sum = PoseCovariance::Zero();
  for (int i = 0; i < kNumSamples; ++i) {
    const Eigen::Matrix<double, 6, 1> error =
        root * Eigen::Matrix<double, 6, 1>::NullaryExpr([&] { return normal(random); });
    Pose off = T_a_b;
    off.translation() += error.head<3>();
    off.linear() = PoseOf({0, 0, 0}, error.tail<3>()).linear() * T_a_b.linear();
    const Eigen::Matrix<double, 6, 1> made = ErrorOf(make(off), make(T_a_b));
    sum += made * made.transpose();
  }
  return sum / kNumSamples;
}

PoseCovariance SomeCovariance() {
  PoseCovariance root = PoseCovariance::Zero();
  root.diagonal() << 0.03, 0.05, 0.02, 0.004, 0.006, 0.01;
  root(5, 0) = 0.004;
  root(1, 0) = -0.02;
  return root * root.transpose();
}

void ExpectNear(const PoseCovariance& actual, const PoseCovariance& expected) {
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double size = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(actual(i, j), expected(i, j), 0.04 * size) << i << " " << j;
    }
  }
}

TEST(PoseCovariance, OfALeverGrowsByItsTurns) {
  const Pose T_map_sensor = PoseOf({10, 20, 1}, {0.1, -0.2, 1.4});
  const Pose T_sensor_base = PoseOf({-2.0, 0.5, -1.5}, {0, 0, 0});
  const PoseCovariance sampled = Sampled(SomeCovariance(), T_map_sensor,
                                         [&](const Pose& pose) { return pose * T_sensor_base; });
  ExpectNear(MovedBy(T_map_sensor.linear() * T_sensor_base.translation(), SomeCovariance()),
             sampled);
}

TEST(PoseCovariance, IsTurnedWithItsFrame) {
  const Pose T_map_place = PoseOf({10, 20, 1}, {0.1, -0.2, 1.4});
  const PoseCovariance sampled = Sampled(SomeCovariance(), PoseOf({1, 2, 0}, {0, 0, 0.3}),
                                         [&](const Pose& pose) { return T_map_place * pose; });
  ExpectNear(Rotated(T_map_place.linear(), SomeCovariance()), sampled);
}

TEST(PoseCovariance, MustBeOne) {
  EXPECT_TRUE(CheckCovariance(SomeCovariance()).ok());
  EXPECT_TRUE(CheckCovariance(PoseCovariance::Zero().eval()).ok());
  PoseCovariance bad = SomeCovariance();
  bad(0, 1) += 0.01;
  EXPECT_TRUE(absl::IsInvalidArgument(CheckCovariance(bad)));
  bad = SomeCovariance();
  bad(2, 2) = -bad(2, 2);
  EXPECT_TRUE(absl::IsInvalidArgument(CheckCovariance(bad)));
  bad(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(absl::IsInvalidArgument(CheckCovariance(bad)));
}

}  // namespace
}  // namespace scanloc
