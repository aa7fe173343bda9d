#include "scanloc/slam/align_drive.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "described_drive.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"

namespace scanloc::slam {
namespace {

/// Odometry carries a guess so far, and is off by so much of the way then.
constexpr double kReach_m = 200.0;
constexpr double kOffPerMetre = 0.05;
constexpr PoseLimits kAgree = {.plane_m = 2.0, .height_m = 2.0, .heading_deg = 20.0};

/// Where scans of a drive are found in a map.
absl::StatusOr<std::vector<FoundConstraint>> FindInMap(const Localizer& localizer,
                                                       const DescribedDrive& drive,
                                                       const DriveOptions& options,
                                                       const std::vector<bool>* excluded) {
  std::vector<std::optional<FoundConstraint>> answers(drive.size());
  const SearchControl control{.is_unwanted = options.graph.is_cancelled, .excluded = excluded};
  const auto ask = [&](std::size_t k, std::size_t) -> absl::Status {
    ASSIGN_OR_RETURN(const Answer answer,
                     localizer.Localize(QueryOf(drive.descriptors[k]), options.query, control));
    if (answer.outcome != Outcome::kLocalized) return absl::OkStatus();
    const Candidate& best = answer.candidates.front();
    FoundConstraint found;
    found.constraint.to = drive.scans[k];
    found.constraint.T_from_to = best.T_map_query;
    found.constraint.information =
        best.covariance ? PoseCovariance(best.covariance->inverse()) : UntoldInformation();
    found.confidence = best.confidence.value_or(1.0);
    answers[k] = std::move(found);
    return absl::OkStatus();
  };
  const auto told = [&](std::size_t num_done) {
    if (options.progress) options.progress("scans looked up", num_done, drive.size());
  };
  const std::size_t num_threads = std::min(NumThreads(options.num_threads), drive.size());
  RETURN_IF_ERROR(RunJobs(num_threads, drive.size(), ask, told));
  std::vector<FoundConstraint> found;
  for (std::optional<FoundConstraint>& answer : answers) {
    if (answer) found.push_back(*std::move(answer));
  }
  return found;
}

/// Which places are of the session.
std::vector<bool> PlacesOf(const Map& map, const std::string& session) {
  std::vector<bool> are_of(map.places.size(), false);
  for (std::size_t i = 0; i < map.places.size(); ++i) {
    are_of[i] = map.sessions[static_cast<std::size_t>(map.places[i].session)] == session;
  }
  return are_of;
}

/// The answer that most others around it agree with by odometry, and how many these are.
struct Support {
  std::size_t best = 0;
  std::size_t num_agreeing = 0;
};
Support FindSupport(const std::vector<FoundConstraint>& found, const mapdb::SessionPlan& plan,
                    const std::vector<double>& along_m) {
  Support support;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Constraint& one = found[i].constraint;
    const Pose T_map_odom = one.T_from_to * plan.scans[one.to].T_map_place.inverse();
    std::size_t num_agreeing = 0;
    for (const FoundConstraint& other : found) {
      const std::size_t scan = other.constraint.to;
      const double way_m = std::abs(along_m[scan] - along_m[one.to]);
      if (way_m > kReach_m) continue;
      PoseLimits limits = kAgree;
      limits.plane_m += kOffPerMetre * way_m;
      limits.height_m += kOffPerMetre * way_m;
      const PoseDifference difference =
          DifferenceOf(T_map_odom * plan.scans[scan].T_map_place, other.constraint.T_from_to);
      num_agreeing += MissOf(difference, limits).any() ? 0 : 1;
    }
    if (num_agreeing > support.num_agreeing) support = {i, num_agreeing};
  }
  return support;
}

std::vector<double> WayOf(const mapdb::SessionPlan& plan) {
  std::vector<double> along_m = {0.0};
  for (std::size_t i = 1; i < plan.scans.size(); ++i) {
    along_m.push_back(along_m.back() + (plan.scans[i].T_map_place.translation() -
                                        plan.scans[i - 1].T_map_place.translation())
                                           .norm());
  }
  return along_m;
}

absl::Status SharesNothing(const DescribedDrive& drive, std::size_t num_found,
                           std::size_t num_agreeing, const Map& map) {
  const std::string found = num_found == 0
                                ? "none is found"
                                : absl::StrFormat("%d are found, of which %d agree with each other",
                                                  num_found, num_agreeing);
  return absl::FailedPreconditionError(absl::StrFormat(
      "the drive shares nothing with the map that can be relied on: of %d scans that were looked "
      "up among %d places, %s; at least %d, and half of those found, must. Tried: every scan at "
      "the spacing, any heading, with the map's own parameters and least confidence. Take a drive "
      "that goes through some part of the map, or build a map of its own from it",
      drive.size(), map.places.size(), found, kMinAgreeing));
}

std::size_t NumOfMap(const ClosedDrive& drive, bool only_on) {
  return static_cast<std::size_t>(std::ranges::count_if(
      drive.constraints,
      [&](const FoundConstraint& c) { return !c.constraint.from && (c.is_on || !only_on); }));
}

}  // namespace

absl::StatusOr<ClosedDrive> AlignDrive(std::shared_ptr<const Map> map,
                                       const mapdb::SessionPlan& plan,
                                       const mapdb::ScanLoader& load_scan,
                                       const DriveOptions& options, const std::string& without) {
  RETURN_IF_ERROR(Validate(options));
  RETURN_IF_ERROR(mapdb::Validate(plan));
  ASSIGN_OR_RETURN(const std::shared_ptr<const Localizer> localizer, Localizer::Create(map));
  ASSIGN_OR_RETURN(const DescribedDrive described,
                   DescribeDrive(map->params, plan, load_scan, options));
  const std::vector<bool> excluded = PlacesOf(*map, without);
  ASSIGN_OR_RETURN(std::vector<FoundConstraint> in_map,
                   FindInMap(*localizer, described, options, &excluded));
  const Support support = FindSupport(in_map, plan, WayOf(plan));
  if (support.num_agreeing < kMinAgreeing) {
    return SharesNothing(described, in_map.size(), support.num_agreeing, *map);
  }

  ClosedDrive drive;
  drive.num_looked_at = described.size();
  const Constraint& best = in_map[support.best].constraint;
  const Pose T_map_odom = best.T_from_to * plan.scans[best.to].T_map_place.inverse();
  for (const mapdb::PlannedScan& scan : plan.scans) {
    drive.T_map_scan.push_back(T_map_odom * scan.T_map_place);
  }
  const std::vector<Constraint> ahead = LookAhead(map->params, described, plan);
  // First by the map alone: with the drift taken out, loops beside the map show.
  for (const bool with_loops : {false, true}) {
    std::vector<FoundConstraint> constraints = in_map;
    if (with_loops) {
      ASSIGN_OR_RETURN(std::vector<FoundConstraint> loops,
                       FindLoops(map->params, described, drive.T_map_scan, options));
      constraints.insert(constraints.end(), loops.begin(), loops.end());
    }
    RETURN_IF_ERROR(OptimizeDrive(plan, ahead, options.graph, std::move(constraints), drive));
    ++drive.num_passes;
  }
  const std::size_t num_on = NumOfMap(drive, true);
  if (num_on < kMinAgreeing || 2 * num_on < NumOfMap(drive, false)) {
    return SharesNothing(described, in_map.size(), num_on, *map);
  }
  return drive;
}

}  // namespace scanloc::slam
