#include "scanloc/eval/trajectory_error.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/eval/quantile.hpp"

namespace scanloc::eval {
namespace {

constexpr double kStretch_m = 100.0;

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

ErrorStatistics StatisticsOf(const std::vector<double>& errors) {
  ErrorStatistics statistics{.num = errors.size()};
  if (errors.empty()) return statistics;
  double sum_of_squares = 0.0;
  for (const double error : errors) sum_of_squares += error * error;
  statistics.rmse = std::sqrt(sum_of_squares / static_cast<double>(errors.size()));
  statistics.mean = *Mean(errors);
  statistics.median = *Quantile(errors, 0.5);
  statistics.max = *std::ranges::max_element(errors);
  return statistics;
}

double AngleDeg(const Pose& pose) {
  return Eigen::AngleAxisd(pose.linear()).angle() * 180.0 / std::numbers::pi;
}

/// T_truth_estimate that brings the positions nearest to each other.
Pose LayOn(std::span<const Pose> truth, std::span<const Pose> estimate) {
  Eigen::Matrix3Xd to(3, truth.size());
  Eigen::Matrix3Xd from(3, truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    to.col(static_cast<Eigen::Index>(i)) = truth[i].translation();
    from.col(static_cast<Eigen::Index>(i)) = estimate[i].translation();
  }
  return Pose(Eigen::umeyama(from, to, /*with_scaling=*/false));
}

Pairs Neighbours(std::size_t num_poses) {
  Pairs pairs;
  for (std::size_t i = 1; i < num_poses; ++i) pairs.emplace_back(i - 1, i);
  return pairs;
}

/// The begin and end of each stretch.
Pairs Stretches(std::span<const Pose> poses) {
  Pairs pairs;
  std::size_t begin = 0;
  double way_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    way_m += (poses[i].translation() - poses[i - 1].translation()).norm();
    if (way_m < kStretch_m) continue;
    pairs.emplace_back(begin, i);
    begin = i;
    way_m = 0.0;
  }
  return pairs;
}

struct RelativeErrors {
  std::vector<double> m;
  std::vector<double> deg;
};
RelativeErrors RelativeErrorsOf(std::span<const Pose> truth, std::span<const Pose> estimate,
                                const Pairs& pairs) {
  RelativeErrors errors;
  for (const auto& [i, j] : pairs) {
    const Pose error =
        (truth[i].inverse() * truth[j]).inverse() * (estimate[i].inverse() * estimate[j]);
    errors.m.push_back(error.translation().norm());
    errors.deg.push_back(AngleDeg(error));
  }
  return errors;
}

}  // namespace

absl::StatusOr<TrajectoryErrors> CompareTrajectories(std::span<const Pose> truth,
                                                     std::span<const Pose> estimate) {
  if (truth.size() != estimate.size() || truth.size() < 2) {
    return absl::InvalidArgumentError(absl::StrCat("the true trajectory has ", truth.size(),
                                                   " poses and the other ", estimate.size(),
                                                   "; give at least 2, and one of each a scan"));
  }
  TrajectoryErrors errors;
  errors.T_truth_estimate = LayOn(truth, estimate);
  std::vector<double> ape_m;
  std::vector<double> ape_deg;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Pose laid = errors.T_truth_estimate * estimate[i];
    ape_m.push_back((laid.translation() - truth[i].translation()).norm());
    ape_deg.push_back(AngleDeg(truth[i].inverse() * laid));
  }
  errors.ape_m = StatisticsOf(ape_m);
  errors.ape_deg = StatisticsOf(ape_deg);
  const RelativeErrors steps = RelativeErrorsOf(truth, estimate, Neighbours(truth.size()));
  errors.rpe_m = StatisticsOf(steps.m);
  errors.rpe_deg = StatisticsOf(steps.deg);
  errors.rpe_100m_m = StatisticsOf(RelativeErrorsOf(truth, estimate, Stretches(truth)).m);
  return errors;
}

}  // namespace scanloc::eval
