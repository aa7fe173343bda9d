#include "structural/wrong_poses.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/median.hpp"
#include "scanloc/core/scan/pose_difference.hpp"

namespace scanloc {
namespace {

constexpr PoseLimits kRight;
/// Pairs tell two hypotheses apart where their misfits differ by so much: .15 m or 1.5°. Those of
/// right drives are .02 in made worlds, .04 in KITTI and .1 in NCLT (medians).
constexpr double kClear = 0.15;
/// So many must speak for a mistake, and half as many at most against it.
constexpr std::size_t kLeastBetter = 6;
/// What fits by this is right.
constexpr double kFits = 0.5;
/// Another mistake is the likelier one only where the misfits are so much less in sum.
constexpr double kFewerMisfits = 0.9;
constexpr double kFewerMisfitsBy = 0.1;
/// Scales nearer to 1 are no other units; two are the same within the second.
constexpr double kOtherScale = 2.0;
constexpr double kSameScale = 1.25;
/// Shorter motions have no direction [m].
constexpr double kMoves_m = 0.1;
/// Shifts are tried up to so many places, by halves of a scan or tenths of a place.
constexpr double kMostPlaces = 10.0;
constexpr double kLeastShift = 0.5;
constexpr double kLeastShiftOfPlace = 0.1;

using PoseOf = std::function<Pose(std::size_t scan)>;

/// What poses would be if a mistake were undone.
struct Remedy {
  std::string cause;
  PoseOf pose_of;
};

Pose Motion(const PairCheck& check, const PoseOf& pose_of) {
  return pose_of(check.first).inverse() * pose_of(check.second);
}

/// By how much a motion differs from what the scans of a pair show, as a share of the limits within
/// which a pose is right; 1 where it exceeds them.
double Misfit(const PairCheck& check, const Pose& T_first_second) {
  double least = 1.0;
  for (const Pose& shown : check.as_good) {
    const PoseDifference difference = DifferenceOf(T_first_second, shown, check.up);
    least = std::min(least, std::max(difference.plane_m / kRight.plane_m,
                                     difference.heading_deg / kRight.heading_deg));
  }
  return least;
}

std::vector<double> Misfits(std::span<const PairCheck> checks, const PoseOf& pose_of) {
  std::vector<double> misfits;
  misfits.reserve(checks.size());
  for (const PairCheck& check : checks) misfits.push_back(Misfit(check, Motion(check, pose_of)));
  return misfits;
}

double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

bool IsScale(double scale, double other, double factor) {
  return std::max(scale, other) <= factor * std::min(scale, other);
}

/// What makes the motions of poses those that the scans show: medians over the pairs that move,
/// where half of these agree; else nothing.
struct Similarity {
  double scale = 1.0;
  double yaw_rad = 0.0;
};

Similarity SimilarityOf(std::span<const PairCheck> checks, const PoseOf& pose_of) {
  std::vector<double> scales;
  std::vector<double> yaws_rad;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const PairCheck& check : checks) {
    const Eigen::Vector2d told = Motion(check, pose_of).translation().head<2>();
    const Eigen::Vector2d shown = check.shown.translation().head<2>();
    if (told.norm() == 0.0 || shown.norm() < kMoves_m) continue;
    scales.push_back(shown.norm() / told.norm());
    const Eigen::Vector2d turn(told.dot(shown), told.x() * shown.y() - told.y() * shown.x());
    yaws_rad.push_back(std::atan2(turn.y(), turn.x()));
    sum += turn.normalized();
  }
  if (scales.empty()) return {};
  const double mean_rad = std::atan2(sum.y(), sum.x());
  for (double& yaw_rad : yaws_rad) yaw_rad = WrapAngle(yaw_rad - mean_rad);
  const Similarity medians{Median(scales), Median(yaws_rad)};
  const auto is_half = [&](const std::vector<double>& values, auto is_alike) {
    return static_cast<std::size_t>(std::ranges::count_if(values, is_alike)) * 2 >= values.size();
  };
  Similarity similarity;
  if (is_half(scales, [&](double s) { return IsScale(s, medians.scale, kSameScale); })) {
    similarity.scale = medians.scale;
  }
  constexpr double kSameYaw_rad = kRight.heading_deg * std::numbers::pi / 180.0;
  if (is_half(yaws_rad, [&](double y) { return std::abs(y - medians.yaw_rad) < kSameYaw_rad; })) {
    similarity.yaw_rad = WrapAngle(mean_rad + medians.yaw_rad);
  }
  return similarity;
}

std::string CauseOfScale(double scale) {
  const struct {
    double scale;
    const char* cause;
  } kUnits[] = {{1e-3, "the translations are in millimetres"},
                {1e-2, "the translations are in centimetres"},
                {1e3, "the translations are in kilometres"},
                {0.3048, "the translations are in feet"},
                {1.0 / 0.3048, "the scans are in feet"}};
  for (const auto& unit : kUnits) {
    if (IsScale(scale, unit.scale, kSameScale)) return unit.cause;
  }
  return absl::StrFormat("motions are %.3g times as long by the poses as by the scans: other units",
                         1.0 / scale);
}

/// In a frame whose axes are the rows, and of a sensor whose axes are these, too.
Pose WithAxes(const Pose& pose, const Eigen::Matrix3d& axes) {
  Pose turned = Pose::Identity();
  turned.linear() = axes * pose.linear() * axes.transpose();
  turned.translation() = axes * pose.translation();
  return turned;
}

Pose Translated(Pose pose, const Eigen::Vector3d& factors) {
  pose.translation() = factors.cwiseProduct(pose.translation());
  return pose;
}

Pose Rotated(Pose pose, const Eigen::Quaterniond& rotation) {
  pose.linear() = rotation.normalized().toRotationMatrix();
  return pose;
}

/// At a number of the drive's scans that may lie between two.
Pose PoseAt(std::span<const Pose> poses, double scan) {
  const double at = std::clamp(scan, 0.0, static_cast<double>(poses.size() - 1));
  const double share = at - std::floor(at);
  const Pose& before = poses[static_cast<std::size_t>(std::floor(at))];
  const Pose& after = poses[static_cast<std::size_t>(std::ceil(at))];
  Pose pose = Rotated(
      before, Eigen::Quaterniond(before.linear()).slerp(share, Eigen::Quaterniond(after.linear())));
  pose.translation() += share * (after.translation() - before.translation());
  return pose;
}

/// Of so many scans whose names are numbers from `first` on: which is where when they are sorted as
/// text.
std::vector<std::size_t> OrderAsText(std::size_t num_scans, std::size_t first) {
  std::vector<std::string> names(num_scans);
  for (std::size_t i = 0; i < num_scans; ++i) names[i] = std::to_string(i + first);
  std::vector<std::size_t> order(num_scans);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) -> const std::string& { return names[i]; });
  return order;
}

/// How many scans the second of a pair comes after the first: 1 where each is a place.
double ScansAPlace(std::span<const PairCheck> checks) {
  std::vector<double> steps;
  for (const PairCheck& check : checks) {
    steps.push_back(static_cast<double>(check.second - check.first));
  }
  return Median(std::move(steps));
}

/// The simplest first. They refer to the poses.
std::vector<Remedy> Remedies(std::span<const PairCheck> checks, std::span<const Pose> poses) {
  std::vector<Remedy> remedies;
  const auto add = [&](std::string cause, auto change) {
    remedies.push_back({std::move(cause), [=](std::size_t scan) { return change(poses[scan]); }});
  };
  const auto [scale, yaw_rad] = SimilarityOf(checks, [&](std::size_t i) { return poses[i]; });
  if (!IsScale(scale, 1.0, kOtherScale)) {
    add(CauseOfScale(scale),
        [s = scale](const Pose& pose) { return Translated(pose, Eigen::Vector3d::Constant(s)); });
  }
  add("the quaternions have w first", [](const Pose& pose) {
    const Eigen::Quaterniond q(pose.linear());
    return Rotated(pose, {q.x(), q.y(), q.z(), q.w()});
  });
  add("the quaternions are read with w first, but have it last", [](const Pose& pose) {
    const Eigen::Quaterniond q(pose.linear());
    return Rotated(pose, {q.z(), q.w(), q.x(), q.y()});
  });
  Eigen::Matrix3d from_camera;  // x right, y down, z forward
  from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  add("the poses are of a camera (x right, y down, z forward); give its calibration",
      [=](const Pose& pose) { return WithAxes(pose, from_camera); });
  const Eigen::Matrix3d to_right = Eigen::Vector3d(1, -1, -1).asDiagonal();
  add("the poses have y to the right: z down, a sensor that hangs, or left-handed axes",
      [=](const Pose& pose) { return WithAxes(pose, to_right); });
  Eigen::Matrix3d swapped;
  swapped << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  add("the poses have x and y swapped", [=](const Pose& pose) { return WithAxes(pose, swapped); });
  add("the poses are inverted: the map seen from the sensor",
      [](const Pose& pose) { return pose.inverse(); });
  add("the rotations are transposed", [](const Pose& pose) {
    return Rotated(pose, Eigen::Quaterniond(pose.linear()).conjugate());
  });
  add("the translations have x mirrored, the rotations have not", [](const Pose& pose) {
    return Translated(pose, {-1, 1, 1});
  });
  add("the translations have y mirrored, the rotations have not", [](const Pose& pose) {
    return Translated(pose, {1, -1, 1});
  });
  if (const double yaw_deg = -yaw_rad * 180.0 / std::numbers::pi;
      std::abs(yaw_deg) > kRight.heading_deg) {
    add(absl::StrFormat("the poses are of a body on which the sensor is turned by %.0f deg; give "
                        "its calibration, or --T-base-sensor with that yaw",
                        yaw_deg),
        [turn = PlanarOffset(0.0, -yaw_rad)](const Pose& pose) { return pose * turn; });
  }
  remedies.push_back({"the files are in the reverse order of the poses",
                      [=](std::size_t scan) { return poses[poses.size() - 1 - scan]; }});
  for (const std::size_t first : {0, 1}) {
    remedies.push_back(
        {"the order of the files is that of their names as text ('10' before '2'), not of their "
         "numbers",
         [=, order = OrderAsText(poses.size(), first)](std::size_t scan) {
           return poses[order[scan]];
         }});
  }
  const double places = ScansAPlace(checks);
  const double step = std::max(kLeastShift, kLeastShiftOfPlace * places);
  for (int k = 1; k * step <= kMostPlaces * places; ++k) {
    for (const double later : {k * step, -k * step}) {
      remedies.push_back(
          {absl::StrFormat("the poses fit the scans better when taken %.3g %s %s: are the stamps "
                           "shifted, or scans left out?",
                           k * step, k * step > 1.0 ? "scans" : "scan",
                           later > 0.0 ? "later" : "earlier"),
           [=](std::size_t scan) { return PoseAt(poses, static_cast<double>(scan) + later); }});
    }
  }
  return remedies;
}

}  // namespace

PoseMistake LikelyMistake(std::span<const PairCheck> checks, std::span<const Pose> poses) {
  // No mistake in poses makes strangers of scans that are neighbours, and those show no motion.
  std::vector<PairCheck> telling;
  for (const PairCheck& check : checks) {
    if (!check.as_good.empty()) telling.push_back(check);
  }
  const std::vector<double> as_told =
      Misfits(telling, [&](std::size_t scan) { return poses[scan]; });
  const auto num_misfitting = static_cast<std::size_t>(
      std::ranges::count_if(as_told, [](double misfit) { return misfit > kClear; }));
  if (num_misfitting < kLeastBetter) return {};

  PoseMistake likely;
  std::vector<double> best = as_told;
  for (const Remedy& remedy : Remedies(telling, poses)) {
    std::vector<double> misfits = Misfits(telling, remedy.pose_of);
    if (Sum(misfits) > kFewerMisfits * Sum(best) - kFewerMisfitsBy) continue;
    best = std::move(misfits);
    likely.cause = remedy.cause;
  }
  std::size_t num_fitting = 0;
  for (std::size_t i = 0; i < best.size(); ++i) {
    num_fitting += best[i] < kFits ? 1 : 0;
    likely.num_better += best[i] < as_told[i] - kClear ? 1 : 0;
    likely.num_worse += best[i] > as_told[i] + kClear ? 1 : 0;
  }
  const bool is_likely = likely.num_better >= kLeastBetter &&
                         likely.num_worse * 2 <= likely.num_better &&
                         num_fitting * 3 >= telling.size() * 2;
  return is_likely ? likely : PoseMistake();
}

}  // namespace scanloc
