#include "scanloc/core/scan/pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace scanloc {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4>;

Matrix34 Sample() {
  Matrix34 m;
  m.leftCols<3>() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  m.col(3) << 10, -20, 3;
  return m;
}

TEST(PoseFromMatrix, KeepsARotationAndTranslation) {
  const auto pose = PoseFromMatrix(Sample());
  ASSERT_TRUE(pose.ok());
  EXPECT_LT((pose->matrix().topRows<3>() - Sample()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(PoseFromMatrix, MendsTheRoundingOfTextFiles) {
  const Matrix34 rounded = (Sample() * 1e4).array().round().matrix() / 1e4;
  const auto pose = PoseFromMatrix(rounded);
  ASSERT_TRUE(pose.ok());
  const Eigen::Matrix3d r = pose->linear();
  EXPECT_LT((r.transpose() * r - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((r - rounded.leftCols<3>()).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(PoseFromMatrix, RefusesWhatIsNoPose) {
  Matrix34 mirrored = Sample();
  mirrored.col(0) *= -1.0;
  Matrix34 scaled = Sample();
  scaled.leftCols<3>() *= 1.1;
  Matrix34 nan = Sample();
  nan(1, 1) = std::nan("");
  Matrix34 far = Sample();
  far(0, 3) = 1e12;
  Matrix34 infinite = Sample();
  infinite(2, 3) = INFINITY;
  for (const Matrix34& bad : {mirrored, scaled, nan, far, infinite, Matrix34(Matrix34::Zero())}) {
    EXPECT_EQ(PoseFromMatrix(bad).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(PoseFromQuaternion, NormalisesAndRefuses) {
  const Eigen::Vector3d t(1, 2, 3);
  const auto pose = PoseFromQuaternion(t, Eigen::Quaterniond(1.0005, 0, 0, 0));
  ASSERT_TRUE(pose.ok());
  EXPECT_EQ(pose->linear(), Eigen::Matrix3d::Identity());
  EXPECT_FALSE(PoseFromQuaternion(t, Eigen::Quaterniond(0, 0, 0, 0)).ok());
  EXPECT_FALSE(PoseFromQuaternion(t, Eigen::Quaterniond(2, 0, 0, 0)).ok());
  EXPECT_FALSE(PoseFromQuaternion(t, Eigen::Quaterniond(std::nan(""), 0, 0, 1)).ok());
  EXPECT_FALSE(PoseFromQuaternion({0, std::nan(""), 0}, Eigen::Quaterniond::Identity()).ok());
}

TEST(PlanarOffset, MovesToTheLeftThenTurns) {
  const Pose offset = PlanarOffset(2.0, std::numbers::pi / 2);
  EXPECT_LT((offset * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 3, 0)).norm(), 1e-12);
  EXPECT_NEAR(Yaw(offset), std::numbers::pi / 2, 1e-12);
}

TEST(WrapAngle, IsInTheHalfOpenTurn) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(WrapAngle(kPi), kPi);
  EXPECT_DOUBLE_EQ(WrapAngle(-kPi), kPi);
  EXPECT_NEAR(WrapAngle(3 * kPi + 0.1), -kPi + 0.1, 1e-12);
  EXPECT_NEAR(WrapAngle(-0.5), -0.5, 1e-15);
}

}  // namespace
}  // namespace scanloc
