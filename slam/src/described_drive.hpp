#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/slam/close_loops.hpp"

namespace scanloc::slam {

/// The scans of a drive that are looked at.
struct DescribedDrive {
  std::vector<std::size_t> scans;  ///< numbers in the plan, ascending
  std::vector<double> along_m;     ///< way from the first scan of the plan
  std::vector<PlaceDescriptor> descriptors;

  [[nodiscard]] std::size_t size() const { return scans.size(); }
};

/// Reads and describes scans that lie spacing_m from each other; those that cannot be read or have
/// no point in range are passed over. Cancelled: the loader said so.
[[nodiscard]] absl::StatusOr<DescribedDrive> DescribeDrive(const Params& params,
                                                           const mapdb::SessionPlan& plan,
                                                           const mapdb::ScanLoader& load_scan,
                                                           const DriveOptions& options);

/// Loops among the scans of a drive that stand at these poses [one a scan of the plan].
[[nodiscard]] absl::StatusOr<std::vector<FoundConstraint>> FindLoops(
    const Params& params, const DescribedDrive& drive, const std::vector<Pose>& T_map_scan,
    const DriveOptions& options);

/// Taken for that of an answer whose method tells none: half a metre, 3 degrees.
[[nodiscard]] PoseCovariance UntoldInformation();

/// What the scans say of the way itself: each is laid on one some metres on. It tells the scale of
/// an odometry, which no loop does: a drive that is shrunk has the same loops.
[[nodiscard]] std::vector<Constraint> LookAhead(const Params& params, const DescribedDrive& drive,
                                                const mapdb::SessionPlan& plan);

/// Without those that are off by much else than most are, seen from odometry: along a plain wall a
/// scan is laid on the one before metres away from where it was.
[[nodiscard]] std::vector<Constraint> WithoutSlips(std::vector<Constraint> ahead,
                                                   const mapdb::SessionPlan& plan);

/// Constraints, and how they come out in the graph.
[[nodiscard]] absl::Status OptimizeDrive(const mapdb::SessionPlan& plan,
                                         const std::vector<Constraint>& ahead,
                                         const GraphOptions& options,
                                         std::vector<FoundConstraint> found, ClosedDrive& drive);

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const DriveOptions& options);

}  // namespace scanloc::slam
