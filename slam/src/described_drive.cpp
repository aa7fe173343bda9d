#include "described_drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/loop_detector.hpp"
#include "scanloc/core/median.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/structural/consistency.hpp"
#include "scanloc/jobs/jobs.hpp"

namespace scanloc::slam {
namespace {

constexpr int kMaxThreads = 256;
constexpr double kMaxMetres = 1e6;
// The detector's clock is the way driven: a standstill is no loop, and drives need no times.
constexpr double kTicksPerMetre = 1e9;
// How far scans are laid on each other to measure the way, and how well that goes.
constexpr double kStretch_m = 6.0;
constexpr double kAhead_m = 0.1;
constexpr double kAhead_rad = 0.006;

/// Numbers of the scans to look at, with the way to each.
DescribedDrive ChooseScans(const mapdb::SessionPlan& plan, double spacing_m) {
  DescribedDrive drive;
  double along_m = 0.0;
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    const Eigen::Vector3d at = plan.scans[i].T_map_place.translation();
    if (i > 0) along_m += (at - plan.scans[i - 1].T_map_place.translation()).norm();
    if (i > 0 &&
        (at - plan.scans[drive.scans.back()].T_map_place.translation()).norm() < spacing_m) {
      continue;
    }
    drive.scans.push_back(i);
    drive.along_m.push_back(along_m);
  }
  return drive;
}

/// Those that have something to show.
DescribedDrive WithoutEmpty(DescribedDrive drive) {
  DescribedDrive kept;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (drive.descriptors[k].num_voxels == 0) continue;
    kept.scans.push_back(drive.scans[k]);
    kept.along_m.push_back(drive.along_m[k]);
    kept.descriptors.push_back(std::move(drive.descriptors[k]));
  }
  return kept;
}

}  // namespace

absl::Status Validate(const DriveOptions& options) {
  if (!(options.spacing_m >= 0.0 && options.spacing_m <= kMaxMetres)) {
    return absl::InvalidArgumentError(
        absl::StrCat("spacing_m is ", options.spacing_m, "; it must be in [0, ", kMaxMetres, "]"));
  }
  if (!(options.window_m > 0.0 && options.window_m <= kMaxMetres)) {
    return absl::InvalidArgumentError(
        absl::StrCat("window_m is ", options.window_m, "; it must be in (0, ", kMaxMetres, "]"));
  }
  if (options.num_threads < 0 || options.num_threads > kMaxThreads) {
    return absl::InvalidArgumentError(absl::StrCat("num_threads is ", options.num_threads,
                                                   "; it must be in [0, ", kMaxThreads, "]"));
  }
  return absl::OkStatus();
}

absl::StatusOr<DescribedDrive> DescribeDrive(const Params& params, const mapdb::SessionPlan& plan,
                                             const mapdb::ScanLoader& load_scan,
                                             const DriveOptions& options) {
  DescribedDrive drive = ChooseScans(plan, options.spacing_m);
  drive.descriptors.resize(drive.size());
  const std::size_t num_threads = std::min(NumThreads(options.num_threads), drive.size());
  ASSIGN_OR_RETURN(std::vector<Describer> describers, MakeDescribers(params, num_threads));
  const auto describe = [&](std::size_t k, std::size_t worker) -> absl::Status {
    const absl::StatusOr<PointCloud> points = load_scan(drive.scans[k]);
    if (absl::IsCancelled(points.status())) return points.status();
    if (points.ok()) drive.descriptors[k] = describers[worker].DescribePlace(*points);
    return absl::OkStatus();
  };
  const auto told = [&](std::size_t num_done) {
    if (options.progress) options.progress("scans described", num_done, drive.size());
  };
  RETURN_IF_ERROR(RunJobs(num_threads, drive.size(), describe, told));
  return WithoutEmpty(std::move(drive));
}

PoseCovariance UntoldInformation() {
  constexpr double kUntold_m = 0.5;
  constexpr double kUntold_rad = 0.05;
  PoseCovariance information = PoseCovariance::Zero();
  information.diagonal().head<3>().setConstant(1.0 / (kUntold_m * kUntold_m));
  information.diagonal().tail<3>().setConstant(1.0 / (kUntold_rad * kUntold_rad));
  return information;
}

absl::StatusOr<std::vector<FoundConstraint>> FindLoops(const Params& params,
                                                       const DescribedDrive& drive,
                                                       const std::vector<Pose>& T_map_scan,
                                                       const DriveOptions& options) {
  ASSIGN_OR_RETURN(LoopDetector detector,
                   LoopDetector::Create(
                       {.params = params, .query = options.query, .window_s = options.window_m}));
  std::vector<FoundConstraint> found;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (options.graph.is_cancelled && options.graph.is_cancelled()) {
      return absl::CancelledError("interrupted while loops were looked for");
    }
    const auto tick = static_cast<std::int64_t>(drive.along_m[k] * kTicksPerMetre);
    ASSIGN_OR_RETURN(const LoopAnswer said, detector.Query(QueryOf(drive.descriptors[k]), tick));
    if (said.loop) {
      const Candidate& best = said.answer.candidates.front();
      FoundConstraint loop;
      loop.constraint.from = drive.scans[static_cast<std::size_t>(said.loop->place)];
      loop.constraint.to = drive.scans[k];
      loop.constraint.T_from_to = said.loop->T_place_scan;
      loop.constraint.information = said.loop->information.value_or(UntoldInformation());
      loop.confidence = best.confidence.value_or(1.0);
      found.push_back(std::move(loop));
    }
    RETURN_IF_ERROR(detector.Add(drive.descriptors[k], tick, T_map_scan[drive.scans[k]]).status());
    if (options.progress) options.progress("scans compared", k + 1, drive.size());
  }
  return found;
}

std::vector<Constraint> WithoutSlips(std::vector<Constraint> ahead,
                                     const mapdb::SessionPlan& plan) {
  // What odometry does always, such as a scale, all of them tell alike.
  constexpr double kFar = 4.0;
  std::array<std::vector<double>, 3> off;  // ahead, to the left [m]; turn [rad]
  for (const Constraint& one : ahead) {
    const Pose step = plan.scans[*one.from].T_map_place.inverse() * plan.scans[one.to].T_map_place;
    const Pose by = step.inverse() * one.T_from_to;
    off[0].push_back(by.translation().x());
    off[1].push_back(by.translation().y());
    off[2].push_back(std::atan2(by.linear()(1, 0), by.linear()(0, 0)));
  }
  std::vector<bool> is_far(ahead.size(), false);
  for (std::size_t axis = 0; axis < off.size(); ++axis) {
    if (ahead.empty()) break;
    const double middle = Median(off[axis]);
    const double most = kFar * (axis == 2 ? kAhead_rad : kAhead_m);
    for (std::size_t i = 0; i < ahead.size(); ++i) {
      is_far[i] = is_far[i] || std::abs(off[axis][i] - middle) > most;
    }
  }
  std::vector<Constraint> kept;
  for (std::size_t i = 0; i < ahead.size(); ++i) {
    if (!is_far[i]) kept.push_back(ahead[i]);
  }
  return kept;
}

std::vector<Constraint> LookAhead(const Params& params, const DescribedDrive& drive,
                                  const mapdb::SessionPlan& plan) {
  // Heights and tilts are those of two grounds, which slope.
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << kAhead_m, kAhead_m, 1.0, 0.1, 0.1, kAhead_rad;
  std::vector<Constraint> ahead;
  std::size_t next = 0;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (drive.along_m[k] < drive.along_m[next] + kStretch_m) continue;
    const std::size_t from = drive.scans[next];
    const std::size_t to = drive.scans[k];
    const PairCheck check =
        CheckPair({0, 1, drive.descriptors[next].structure, drive.descriptors[k].structure},
                  plan.scans[from].T_map_place, plan.scans[to].T_map_place, params.automatic);
    if (check.verdict == PairCheck::Verdict::kAgrees) {
      Constraint constraint{.from = from, .to = to, .T_from_to = check.shown};
      constraint.information = sigma.cwiseProduct(sigma).cwiseInverse().asDiagonal();
      constraint.is_trusted = true;
      ahead.push_back(constraint);
    }
    next = k;
  }
  return WithoutSlips(std::move(ahead), plan);
}

absl::Status OptimizeDrive(const mapdb::SessionPlan& plan, const std::vector<Constraint>& ahead,
                           const GraphOptions& options, std::vector<FoundConstraint> found,
                           ClosedDrive& drive) {
  PoseGraph graph;
  for (const mapdb::PlannedScan& scan : plan.scans) graph.T_odom_scan.push_back(scan.T_map_place);
  graph.T_map_scan = drive.T_map_scan;
  for (const FoundConstraint& one : found) graph.constraints.push_back(one.constraint);
  graph.constraints.insert(graph.constraints.end(), ahead.begin(), ahead.end());
  ASSIGN_OR_RETURN(OptimizedGraph optimized, Optimize(graph, options));
  drive.T_map_scan = std::move(optimized.T_map_scan);
  drive.drift = optimized.drift;
  drive.noise = optimized.noise;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Constraint& constraint = found[i].constraint;
    Pose stands = drive.T_map_scan[constraint.to];
    if (constraint.from) stands = drive.T_map_scan[*constraint.from].inverse() * stands;
    found[i].is_on = optimized.is_on[i];
    found[i].chi2 = optimized.chi2[i];
    found[i].error = stands.inverse() * constraint.T_from_to;
  }
  drive.constraints = std::move(found);
  return absl::OkStatus();
}

}  // namespace scanloc::slam
