#include "scanloc/eval/trajectory_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace scanloc::eval {
namespace {

constexpr double kExact = 2e-9;

Pose MakePose(double yaw, double roll, const Eigen::Vector3d& at) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = at;
  return pose;
}

/// 480 m round a circle, and what an odometry in another frame made of it.
std::vector<Pose> Truth() {
  std::vector<Pose> poses;
  for (int i = 0; i < 400; ++i) {
    const double a = 0.02 * i;
    poses.push_back(MakePose(a, 0.1 * std::sin(a),
                             {60 * std::cos(a), 60 * std::sin(a), 0.5 * std::sin(3 * a)}));
  }
  return poses;
}

std::vector<Pose> Odometry() {
  std::vector<Pose> poses;
  for (int i = 0; i < 400; ++i) {
    const double a = 0.02 * i;
    const double b = 0.0203 * i + 0.7;
    poses.push_back(MakePose(
        b, 0.1 * std::sin(a) + 0.01 * std::cos(5 * a),
        {5 + 61 * std::cos(b), -3 + 61 * std::sin(b), 2 + 0.5 * std::sin(3 * a) + 0.001 * i}));
  }
  return poses;
}

void ExpectStatistics(const ErrorStatistics& found, const ErrorStatistics& expected) {
  EXPECT_NEAR(found.rmse, expected.rmse, kExact);
  EXPECT_NEAR(found.mean, expected.mean, kExact);
  EXPECT_NEAR(found.median, expected.median, kExact);
  EXPECT_NEAR(found.max, expected.max, kExact);
  EXPECT_EQ(found.num, expected.num);
}

// The numbers are those of evo 1.38.1 for the same trajectories.
TEST(CompareTrajectories, GivesTheNumbersOfEvo) {
  const auto errors = CompareTrajectories(Truth(), Odometry());
  ASSERT_TRUE(errors.ok()) << errors.status();
  ExpectStatistics(errors->ape_m, {2.249176893, 2.075957528, 1.583253984, 4.126940981, 400});
  ExpectStatistics(errors->ape_deg, {2.025943368, 1.794767287, 1.749964616, 3.481811776, 400});
  ExpectStatistics(errors->rpe_m, {0.03925416, 0.039247619, 0.039207511, 0.040785307, 399});
  ExpectStatistics(errors->rpe_deg, {0.044951066, 0.042873662, 0.045236484, 0.059792486, 399});
  ExpectStatistics(errors->rpe_100m_m, {2.792129241, 2.792106332, 2.793006156, 2.804095475, 4});
}

TEST(CompareTrajectories, SeesNoErrorInAnotherFrame) {
  const Pose T_other_map = MakePose(1.1, 0.3, {1e6, -2e6, 30.0});
  std::vector<Pose> moved = Truth();
  for (Pose& pose : moved) pose = T_other_map * pose;
  const auto errors = CompareTrajectories(Truth(), moved);
  ASSERT_TRUE(errors.ok()) << errors.status();
  EXPECT_LT(errors->ape_m.max, 1e-6);
  EXPECT_LT(errors->rpe_100m_m.max, 1e-6);
}

TEST(CompareTrajectories, RefusesTrajectoriesOfDifferentLengths) {
  const std::vector<Pose> truth = Truth();
  EXPECT_TRUE(
      absl::IsInvalidArgument(CompareTrajectories(truth, std::span(truth).first(399)).status()));
  const std::span<const Pose> one = std::span(truth).first(1);
  EXPECT_TRUE(absl::IsInvalidArgument(CompareTrajectories(one, one).status()));
}

}  // namespace
}  // namespace scanloc::eval
