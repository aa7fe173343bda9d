#include "scanloc/slam/pose_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "scanloc/eval/trajectory_error.hpp"

namespace scanloc::slam {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

Pose MakePose(const Eigen::Vector3d& at, const Eigen::Vector3d& turn) {
  Pose pose = Pose::Identity();
  pose.translation() = at;
  if (turn.norm() > 0.0) {
    pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  return pose;
}

/// Moved along, and turned about, its own axes.
Pose Disturbed(const Pose& pose, const Vector6& by) {
  return pose * MakePose(by.head<3>(), by.tail<3>());
}

/// 3 km round blocks of 200 m, up and down, each street driven three times.
std::vector<Pose> Town() {
  std::vector<Pose> poses;
  double yaw = 0.0;
  Eigen::Vector2d at(0.0, 0.0);
  for (int i = 0; i < 2000; ++i) {
    const double along = 1.5 * i;
    poses.push_back(MakePose({at.x(), at.y(), 2.0 * std::sin(at.x() / 60.0)}, {0.0, 0.0, yaw}));
    at += 1.5 * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
    // Left at each corner, but at every fourth block on: an 8 of two blocks.
    if (i % 133 == 132) yaw += (static_cast<int>(along / 200.0) % 8 < 4 ? 1 : -1) * M_PI / 2.0;
  }
  return poses;
}

class DriftingDrive {
 public:
  explicit DriftingDrive(unsigned seed) : random_(seed), truth_(Town()) {
    const double scale = 1.0 + 0.01 * normal_(random_);
    const double bend = 2e-4 * normal_(random_);
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      if (i == 0) {
        graph_.T_odom_scan.push_back(truth_[0]);
        continue;
      }
      Pose step = truth_[i - 1].inverse() * truth_[i];
      const double length = step.translation().norm();
      step.translation() *= scale + 0.005 * normal_(random_);
      step =
          step * MakePose({0, 0, 0.003 * length}, {1e-4 * normal_(random_), 1e-4 * normal_(random_),
                                                   bend * length + 2e-4 * normal_(random_)});
      graph_.T_odom_scan.push_back(graph_.T_odom_scan.back() * step);
    }
    graph_.T_map_scan = graph_.T_odom_scan;
  }

  /// True loops at revisits, of every scan or of fewer, as a registration would tell them.
  void CloseLoops(std::size_t every = 1) {
    for (std::size_t i = 0; i < truth_.size(); i += every) {
      for (std::size_t j = 0; j + 60 < i; ++j) {
        if ((truth_[i].translation() - truth_[j].translation()).norm() > 1.0) continue;
        graph_.constraints.push_back(Loop(j, i, truth_[j].inverse() * truth_[i]));
        break;
      }
    }
  }

  /// So many loops that put a scan where it never was, as places that look alike do.
  std::size_t AddFalseLoops(double share) {
    const auto num_right = static_cast<double>(graph_.constraints.size());
    const auto num = static_cast<std::size_t>(share / (1.0 - share) * num_right);
    std::uniform_int_distribution<std::size_t> any(0, truth_.size() - 1);
    for (std::size_t added = 0; added < num;) {
      const std::size_t i = any(random_);
      const std::size_t j = any(random_);
      if (j + 60 >= i || (truth_[i].translation() - truth_[j].translation()).norm() < 20.0) {
        continue;
      }
      graph_.constraints.push_back(Loop(j, i,
                                        MakePose({normal_(random_), normal_(random_), 0.0},
                                                 {0.0, 0.0, 0.05 * normal_(random_)})));
      ++added;
    }
    return num;
  }

  /// So many false loops, of stretches of 30 m that look like others all along: the loops of one
  /// agree with each other, and with the odometry between them.
  std::size_t AddFalseStretches(double share) {
    constexpr std::size_t kLength = 20;
    const auto num_right = static_cast<double>(graph_.constraints.size());
    const auto num = static_cast<std::size_t>(share / (1.0 - share) * num_right);
    std::uniform_int_distribution<std::size_t> any(0, truth_.size() - 1 - kLength);
    std::size_t added = 0;
    while (added < num) {
      const std::size_t i = any(random_);
      const std::size_t j = any(random_);
      const Eigen::Vector3d apart = truth_[i].translation() - truth_[j].translation();
      const bool is_straight = IsStraight(i, kLength) && IsStraight(j, kLength);
      if (j + 60 >= i || apart.norm() < 20.0 || !is_straight) continue;
      const Pose stands =
          MakePose({normal_(random_), normal_(random_), 0.0}, {0.0, 0.0, 0.02 * normal_(random_)});
      for (std::size_t k = 0; k < kLength && added < num; k += 2, ++added) {
        const Pose T_from_to = (truth_[j].inverse() * truth_[j + k]).inverse() * stands *
                               (truth_[i].inverse() * truth_[i + k]);
        graph_.constraints.push_back(Loop(j + k, i + k, T_from_to));
      }
    }
    return added;
  }

  /// What scans say of the way: the scale is in no loop.
  void LookAhead() {
    for (std::size_t i = 4; i < truth_.size(); i += 4) {
      Constraint ahead = Loop(i - 4, i, truth_[i - 4].inverse() * truth_[i]);
      ahead.is_trusted = true;
      graph_.constraints.push_back(ahead);
    }
  }

  double Ate(const std::vector<Pose>& poses) const {
    return eval::CompareTrajectories(truth_, poses)->ape_m.rmse;
  }

  PoseGraph& graph() { return graph_; }
  const std::vector<Pose>& truth() const { return truth_; }

 private:
  bool IsStraight(std::size_t i, std::size_t length) const {
    return Eigen::AngleAxisd((truth_[i].inverse() * truth_[i + length]).linear()).angle() < 0.2;
  }

  Constraint Loop(std::size_t from, std::size_t to, const Pose& T_from_to) {
    Vector6 sigma;
    sigma << 0.05, 0.05, 0.02, 0.003, 0.003, 0.002;
    Vector6 noise;
    for (int i = 0; i < 6; ++i) noise(i) = sigma(i) * normal_(random_);
    Constraint loop{.from = from, .to = to, .T_from_to = Disturbed(T_from_to, noise)};
    loop.information = Matrix6(sigma.cwiseProduct(sigma).cwiseInverse().asDiagonal());
    return loop;
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Pose> truth_;
  PoseGraph graph_;
};

class Optimized : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Optimized, testing::Values(1U, 4U, 6U));

TEST_P(Optimized, TakesTheDriftOutOfThreeKilometres) {
  DriftingDrive drive(GetParam());
  drive.CloseLoops();
  drive.LookAhead();
  const auto optimized = Optimize(drive.graph());
  ASSERT_TRUE(optimized.ok()) << optimized.status();
  const double before_m = drive.Ate(drive.graph().T_odom_scan);
  const double after_m = drive.Ate(optimized->T_map_scan);
  EXPECT_LT(after_m, 0.5);
  EXPECT_LT(5.0 * after_m, before_m);
  EXPECT_EQ(optimized->num_on(), drive.graph().constraints.size());
}

/// Of a drive with so many right loops, and false ones behind them.
void ExpectRightLoopsOnly(DriftingDrive& drive, std::size_t num_right, std::size_t num_false) {
  const auto optimized = Optimize(drive.graph());
  ASSERT_TRUE(optimized.ok()) << optimized.status();
  EXPECT_LT(drive.Ate(optimized->T_map_scan), 0.5);
  const auto on = optimized->is_on.begin() + static_cast<std::ptrdiff_t>(num_right);
  EXPECT_EQ(std::count(on, on + static_cast<std::ptrdiff_t>(num_false), true), 0);
  EXPECT_EQ(std::count(optimized->is_on.begin(), on, false), 0);
}

TEST_P(Optimized, SwitchesFalseLoopsOff) {
  DriftingDrive drive(GetParam());
  drive.CloseLoops(5);
  const std::size_t num_right = drive.graph().constraints.size();
  const std::size_t num_false = drive.AddFalseLoops(0.3);
  drive.LookAhead();
  ExpectRightLoopsOnly(drive, num_right, num_false);
}

// The drifts of these odometries, up to 38 m, are as large as what false loops are off by.
TEST_P(Optimized, SwitchesFalseLoopsOffThatAgree) {
  for (const std::size_t every : {5, 25}) {
    DriftingDrive drive(GetParam());
    drive.CloseLoops(every);
    const std::size_t num_right = drive.graph().constraints.size();
    const std::size_t num_false = drive.AddFalseStretches(0.3);
    drive.LookAhead();
    ExpectRightLoopsOnly(drive, num_right, num_false);
  }
}

TEST(Optimize, KeepsTheOdometryWhereThereAreNoLoops) {
  DriftingDrive drive(4);
  const auto optimized = Optimize(drive.graph());
  ASSERT_TRUE(optimized.ok()) << optimized.status();
  for (std::size_t i = 0; i < optimized->T_map_scan.size(); ++i) {
    EXPECT_TRUE(optimized->T_map_scan[i].isApprox(drive.graph().T_odom_scan[i], 1e-9));
  }
}

TEST(Optimize, GoesIntoTheFrameOfTheMapByConstraintsToIt) {
  DriftingDrive drive(5);
  const Pose T_map_world = MakePose({4.5e5, 5.4e6, 200.0}, {0.0, 0.0, 2.0});
  for (std::size_t i = 300; i < drive.truth().size(); i += 20) {
    Constraint in_map{.to = i, .T_from_to = T_map_world * drive.truth()[i]};
    in_map.information *= 400.0;
    drive.graph().constraints.push_back(in_map);
  }
  for (Pose& pose : drive.graph().T_map_scan) pose = T_map_world * pose;
  const auto optimized = Optimize(drive.graph());
  ASSERT_TRUE(optimized.ok()) << optimized.status();
  for (std::size_t i = 300; i < drive.truth().size(); ++i) {
    const Pose error = (T_map_world * drive.truth()[i]).inverse() * optimized->T_map_scan[i];
    EXPECT_LT(error.translation().norm(), 0.3) << "scan " << i;
  }
  // The drift that was found serves before the map begins, too.
  const Pose first = (T_map_world * drive.truth()[0]).inverse() * optimized->T_map_scan[0];
  EXPECT_LT(first.translation().norm(), 1.0);
}

TEST(Optimize, RefusesGraphsThatAreNone) {
  DriftingDrive drive(6);
  const PoseGraph good = drive.graph();
  const auto refused = [](const PoseGraph& graph) {
    return absl::IsInvalidArgument(Optimize(graph).status());
  };
  PoseGraph bad = good;
  bad.T_map_scan.pop_back();
  EXPECT_TRUE(refused(bad));
  EXPECT_TRUE(refused({}));
  bad = good;
  bad.constraints = {{.from = 0, .to = good.T_odom_scan.size()}};
  EXPECT_TRUE(refused(bad));
  bad.constraints = {{.from = 7, .to = 7}};
  EXPECT_TRUE(refused(bad));
  bad.constraints = {{.from = 0, .to = 7, .information = -Matrix6::Identity()}};
  EXPECT_TRUE(refused(bad));
}

}  // namespace
}  // namespace scanloc::slam
