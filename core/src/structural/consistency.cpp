#include "scanloc/core/structural/consistency.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>
#include <numeric>

#include "absl/strings/str_format.h"
#include "scan/bearing.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/query_match.hpp"
#include "structural/wrong_poses.hpp"

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

/// Where scans lie as well beside the best pose, as in a tunnel, they show no motion that way:
/// looked for by steps up to so far [m], unless the poses say the same.
constexpr double kSamePlace_m = 0.1;
constexpr double kBeside_m = 1.0;
constexpr double kFarBeside_m = 4.0;

/// The poses around one that score enough.
std::vector<PlanarPose> AsGoodBeside(const QueryMatch& query, const PlanarPose& best,
                                     double enough) {
  constexpr int kDirections = 8;
  std::vector<PlanarPose> as_good;
  for (int k = 0; k < kDirections; ++k) {
    const double direction_rad = 2.0 * std::numbers::pi * k / kDirections;
    for (double off_m = kBeside_m; off_m <= kFarBeside_m; off_m += kBeside_m) {
      const PlanarPose beside{best.x_m + off_m * std::cos(direction_rad),
                              best.y_m + off_m * std::sin(direction_rad), best.yaw_rad};
      if (query.Score(beside) < enough) break;
      as_good.push_back(beside);
    }
  }
  return as_good;
}

/// Of right drives no pair in forty is against; of files sorted as text one in eight.
constexpr std::size_t kMaxShareDivisor = 12;
/// That the poses fit clearly better without a mistake is no chance where so many times fewer pairs
/// speak against it.
constexpr std::size_t kTimesWorse = 4;

using Verdict = PairCheck::Verdict;

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

  const auto pose_of = [&](const PlanarPose& pose) -> Pose {
    Pose level = PlanarOffset(pose.y_m, pose.yaw_rad);
    level.translation().x() = pose.x_m;
    level.translation().z() = pair.second_structure.height_m - pair.first_structure.height_m;
    return from_first.inverse() * level * from_second;
  };
  const PlanarPose& best = guesses.front().T_place_query;
  check.score = guesses.front().score;
  check.shown = pose_of(best);
  check.up = from_first.linear().row(2);
  query.SetPlace(pair.first_structure);
  if (check.score >= kLiesWell) {
    const double as_good = kAsGood * check.score;
    for (const Hypothesis& guess : guesses) {
      if (guess.score >= as_good) check.as_good.push_back(pose_of(guess.T_place_query));
    }
    const bool is_not_bad = query.Score(told) >= kNotBad * check.score;
    const bool agrees = is_not_bad || std::ranges::any_of(check.as_good, [&](const Pose& shown) {
                          return Agree(check.told, shown);
                        });
    check.verdict = agrees ? Verdict::kAgrees : Verdict::kContradicts;
    if (DifferenceOf(check.told, check.shown, check.up).plane_m > kSamePlace_m) {
      const std::vector<PlanarPose> beside = AsGoodBeside(query, best, as_good);
      for (const PlanarPose& pose : beside) check.as_good.push_back(pose_of(pose));
      // What slides may lie anywhere between.
      if (is_not_bad && !beside.empty()) check.as_good.push_back(check.told);
    }
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
  const PoseMistake mistake = LikelyMistake(checks, poses);
  const bool is_mistaken =
      !mistake.cause.empty() && mistake.num_worse * kTimesWorse <= mistake.num_better;
  report.is_inconsistent =
      is_mistaken ||
      (against >= kMinContradictions && against * kMaxShareDivisor > report.num_agreeing + against);
  if (!report.is_inconsistent) return report;
  report.likely_cause = absl::StrFormat("%s (%d pairs fit clearly better so, %d worse)",
                                        mistake.cause, mistake.num_better, mistake.num_worse);
  if (mistake.cause.empty()) {
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
