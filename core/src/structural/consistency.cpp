#include "scanloc/core/structural/consistency.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <functional>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "scan/bearing.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/query_match.hpp"

namespace scanloc {
namespace {

/// Fewer posts say nothing; with so many, scans of one spot are alike.
constexpr std::size_t kMinPairPosts = 30;
constexpr std::size_t kManyPosts = 80;
/// Scans as near to each other as this show the same [m].
constexpr double kNear_m = 3.0;
/// Scores of neighbouring scans are .6 and more where the registration is right; those of strangers
/// seldom reach .35 (NCLT, KITTI, simulated towns and buildings).
constexpr double kLiesWell = 0.5;
constexpr double kStrange = 0.35;
/// A registration as the poses say that scores so much of the best is as good.
constexpr double kAsGood = 0.9;
/// Nor does it speak against the poses where the scans, laid as they say, score so much of it: at a
/// door or in an aisle another pose may be as good by chance.
constexpr double kNotBad = 0.75;
/// How far the shown motion may differ from the told one: noise of both, and of long steps a share.
constexpr double kTolerance_m = 1.0;
constexpr double kTolerancePerMetre = 0.1;

/// Scans that look in the same directions in less than this share of the narrower one's view cannot
/// be laid on each other: those of a sensor with 70° of view, where a robot turns.
constexpr double kSeenByBoth = 0.5;

PlanarPose Planar(const Pose& pose) {
  return {pose.translation().x(), pose.translation().y(), Yaw(pose)};
}

bool Agree(const Pose& told, const Pose& shown) {
  PoseLimits limits;
  limits.plane_m = kTolerance_m + kTolerancePerMetre * told.translation().norm();
  const PoseDifference difference = DifferenceOf(told, shown);
  // The height of a planar registration is that of the grounds; slopes between scans are no error.
  return difference.plane_m <= limits.plane_m && difference.heading_deg <= limits.heading_deg;
}

using View = std::bitset<36>;

/// The directions in which anything stands, of a scan that is turned so.
View ViewOf(std::span<const Post> posts, double yaw_rad) {
  const Eigen::Rotation2Df turn(static_cast<float>(yaw_rad));
  View view;
  for (const Post& post : posts) {
    const Eigen::Vector2f at = turn * Eigen::Vector2f(post.x_cm, post.y_cm);
    view.set(
        static_cast<std::size_t>(SectorFromRear(at.x(), at.y(), static_cast<int>(view.size()))));
  }
  return view;
}

bool LookTheSameWay(const ScanPair& pair, double yaw_rad) {
  const View first = ViewOf(pair.first_structure.posts, 0.0);
  const View second = ViewOf(pair.second_structure.posts, yaw_rad);
  return static_cast<double>((first & second).count()) >=
         kSeenByBoth * static_cast<double>(std::min(first.count(), second.count()));
}

/// Of right drives no pair in forty is against; of files sorted as text one in eight.
constexpr std::size_t kMaxShareDivisor = 12;

using Verdict = PairCheck::Verdict;

bool SaysAnything(const PairCheck& check) {
  return check.verdict == Verdict::kAgrees || check.verdict == Verdict::kContradicts;
}

/// A mistake that poses are often made with, undone.
struct Remedy {
  std::string cause;
  std::function<Pose(std::span<const Pose> poses, std::size_t scan)> undo;
};

Pose Scaled(Pose pose, double factor) {
  pose.translation() *= factor;
  return pose;
}

Pose Conjugated(const Pose& pose, const Eigen::Matrix3d& axes) {
  Pose turned = Pose::Identity();
  turned.linear() = axes * pose.linear() * axes.transpose();
  turned.translation() = axes * pose.translation();
  return turned;
}

/// The rotation whose quaternion was read from other positions of the row.
Pose Reordered(Pose pose, bool first_was_w) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Quaterniond right = first_was_w ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())
                                               : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
  pose.linear() = right.normalized().toRotationMatrix();
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

std::vector<Remedy> Remedies(std::size_t num_scans) {
  const auto each = [](auto change) {
    return [change](std::span<const Pose> poses, std::size_t scan) { return change(poses[scan]); };
  };
  Eigen::Matrix3d from_camera;  // x right, y down, z forward
  from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Matrix3d from_z_down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  std::vector<Remedy> remedies{
      {"the translations are in millimetres", each([](const Pose& p) { return Scaled(p, 1e-3); })},
      {"the translations are in centimetres", each([](const Pose& p) { return Scaled(p, 1e-2); })},
      {"the quaternions have w first", each([](const Pose& p) { return Reordered(p, true); })},
      {"the quaternions are read with w first, but have it last",
       each([](const Pose& p) { return Reordered(p, false); })},
      {"the poses are of a camera (x right, y down, z forward); give its calibration",
       each([=](const Pose& p) { return Conjugated(p, from_camera); })},
      {"the poses have y to the right and z down",
       each([=](const Pose& p) { return Conjugated(p, from_z_down); })},
      {"the poses are inverted: the map seen from the sensor",
       each([](const Pose& p) { return p.inverse(); })},
      {"the files are in the reverse order of the poses",
       [](std::span<const Pose> poses, std::size_t scan) {
         return poses[poses.size() - 1 - scan];
       }}};
  for (const std::size_t first : {0, 1}) {
    remedies.push_back(
        {"the order of the files is that of their names as text ('10' before '2'), not of their "
         "numbers",
         [order = OrderAsText(num_scans, first)](std::span<const Pose> poses, std::size_t scan) {
           return poses[order[scan]];
         }});
  }
  for (int k = 1; k <= 10; ++k) {
    for (const int shift : {k, -k}) {
      remedies.push_back({absl::StrCat("poses and scans are shifted against each other by ", k,
                                       k == 1 ? " scan" : " scans", ": stamps, or scans left out"),
                          [shift](std::span<const Pose> poses, std::size_t scan) {
                            const auto last = static_cast<std::ptrdiff_t>(poses.size()) - 1;
                            const auto at = std::clamp<std::ptrdiff_t>(
                                static_cast<std::ptrdiff_t>(scan) + shift, 0, last);
                            return poses[static_cast<std::size_t>(at)];
                          }});
    }
  }
  return remedies;
}

std::size_t CountAgreeing(std::span<const PairCheck> checks, const auto& pose_of) {
  return static_cast<std::size_t>(
      std::count_if(checks.begin(), checks.end(), [&](const PairCheck& check) {
        return SaysAnything(check) &&
               Agree(pose_of(check.first).inverse() * pose_of(check.second), check.shown);
      }));
}

/// The mistake without which most pairs agree, and more than with it.
std::string LikelyCause(std::span<const PairCheck> checks, std::span<const Pose> poses,
                        const ConsistencyReport& report) {
  // No mistake in poses makes strangers of scans that are neighbours.
  const std::size_t num_telling =
      report.num_agreeing + report.num_contradicting + report.num_strangers;
  std::size_t best = std::max(num_telling * 4 / 5, report.num_agreeing);
  std::string cause;
  for (const Remedy& remedy : Remedies(poses.size())) {
    const std::size_t num_agreeing =
        CountAgreeing(checks, [&](std::size_t scan) { return remedy.undo(poses, scan); });
    if (num_agreeing > best) {
      best = num_agreeing;
      cause = remedy.cause;
    }
  }
  return cause;
}

}  // namespace

PairCheck CheckPair(const ScanPair& pair, const Pose& T_map_first, const Pose& T_map_second,
                    const AutoParams& params) {
  PairCheck check{.first = pair.first, .second = pair.second};
  check.told = T_map_first.inverse() * T_map_second;
  const std::size_t num_posts =
      std::min(pair.first_structure.posts.size(), pair.second_structure.posts.size());
  if (num_posts < kMinPairPosts) return check;

  const Pose from_first = LevelFromSensor(pair.first_structure);
  const Pose from_second = LevelFromSensor(pair.second_structure);
  const PlanarPose told = Planar(from_first * check.told * from_second.inverse());
  if (!LookTheSameWay(pair, told.yaw_rad)) return check;
  std::vector<Hypothesis> guesses{{0, told, 0.0}, {0, {}, 0.0}, {0, {0.0, 0.0, told.yaw_rad}, 0.0}};
  const double ring_m = params.shortlist.bearing_ring_m;
  for (const double yaw_rad :
       AgreeingHeadings(pair.first_structure.posts, pair.second_structure.posts, ring_m, 3)) {
    guesses.push_back({0, {0.0, 0.0, yaw_rad}, 0.0});
  }
  // What agrees is judged from above: heights and inliers say more of which place than of how it
  // lies.
  AutoParams from_above = params;
  from_above.verify.heights_share = 0.0;
  from_above.evidence.inliers_share = 0.0;
  MatchGrids grids(from_above);
  QueryMatch query(pair.second_structure, from_above, pair.first_structure.height_m, grids);
  const PlanarPoints place(pair.first_structure.posts,
                           static_cast<std::size_t>(params.verify.at_once.num_posts));
  for (Hypothesis& guess : guesses) {
    query.LayCoarsely(place, params.verify.at_once.steps, guess);
    query.LayFinely(pair.first_structure, guess);
  }
  std::stable_sort(guesses.begin(), guesses.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });

  const auto pose_of = [&](const Hypothesis& hypothesis) -> Pose {
    Pose level = PlanarOffset(hypothesis.T_place_query.y_m, hypothesis.T_place_query.yaw_rad);
    level.translation().x() = hypothesis.T_place_query.x_m;
    level.translation().z() = pair.second_structure.height_m - pair.first_structure.height_m;
    return from_first.inverse() * level * from_second;
  };
  check.score = guesses.front().score;
  check.shown = pose_of(guesses.front());
  query.SetPlace(pair.first_structure);
  const bool agrees =
      query.Score(told) >= kNotBad * check.score ||
      std::any_of(guesses.begin(), guesses.end(), [&](const Hypothesis& hypothesis) {
        return hypothesis.score >= kAsGood * check.score && Agree(check.told, pose_of(hypothesis));
      });
  if (check.score >= kLiesWell) {
    check.verdict = agrees ? Verdict::kAgrees : Verdict::kContradicts;
  } else if (check.score < kStrange && num_posts >= kManyPosts &&
             check.told.translation().norm() < kNear_m) {
    check.verdict = Verdict::kStrangers;
  }
  return check;
}

ConsistencyReport JudgeDrive(std::span<const PairCheck> checks, std::span<const Pose> poses) {
  ConsistencyReport report;
  for (const PairCheck& check : checks) {
    report.num_agreeing += check.verdict == Verdict::kAgrees ? 1 : 0;
    report.num_contradicting += check.verdict == Verdict::kContradicts ? 1 : 0;
    report.num_strangers += check.verdict == Verdict::kStrangers ? 1 : 0;
  }
  const std::size_t against = report.num_contradicting + report.num_strangers;
  report.is_inconsistent =
      against >= kMinContradictions && against * kMaxShareDivisor > report.num_agreeing + against;
  if (!report.is_inconsistent) return report;
  report.likely_cause = LikelyCause(checks, poses, report);
  if (report.likely_cause.empty()) {
    report.likely_cause =
        "no single mistake explains it: look whether each pose belongs to its scan, first at the "
        "order of the files";
  }
  return report;
}

std::vector<std::size_t> PairsToCheck(std::span<const Pose> poses, std::size_t max_pairs) {
  std::vector<std::size_t> firsts;
  if (poses.size() < 2) return firsts;
  const std::size_t num_pairs = poses.size() - 1;
  const std::size_t num_even = std::min(num_pairs, max_pairs - max_pairs / 4);
  for (std::size_t k = 0; k < num_even; ++k) firsts.push_back(k * num_pairs / num_even);
  // Where the drive begins or ends to turn a shift of poses against scans shows, which a straight
  // road and an even bend hide.
  std::vector<double> turns_deg(num_pairs);
  for (std::size_t i = 0; i < num_pairs; ++i) {
    turns_deg[i] = DifferenceOf(poses[i], poses[i + 1]).heading_deg;
  }
  const auto change_at = [&](std::size_t i) {
    const double before_deg = i > 0 ? std::abs(turns_deg[i] - turns_deg[i - 1]) : 0.0;
    const double after_deg = i + 1 < num_pairs ? std::abs(turns_deg[i] - turns_deg[i + 1]) : 0.0;
    return std::max(before_deg, after_deg);
  };
  std::vector<std::size_t> by_change(num_pairs);
  std::iota(by_change.begin(), by_change.end(), std::size_t{0});
  std::stable_sort(by_change.begin(), by_change.end(),
                   [&](std::size_t a, std::size_t b) { return change_at(a) > change_at(b); });
  by_change.resize(std::min(num_pairs, max_pairs / 4));
  firsts.insert(firsts.end(), by_change.begin(), by_change.end());
  std::sort(firsts.begin(), firsts.end());
  firsts.erase(std::unique(firsts.begin(), firsts.end()), firsts.end());
  return firsts;
}

}  // namespace scanloc
