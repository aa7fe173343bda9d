#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/slam/pose_graph.hpp"

namespace scanloc::slam {

/// How far a long work is; `stage` names what is counted. Called from the caller's thread.
using DriveProgress =
    std::function<void(const char* stage, std::size_t num_done, std::size_t num_total)>;

struct DriveOptions {
  Query query;             ///< by which loops are looked for: method, confidence
  double spacing_m = 1.0;  ///< scans nearer to the one before are not looked at; from 0
  /// Way that must lie between two scans of a loop: of course a robot is where it just was [m];
  /// above 0.
  double window_m = 30.0;
  int num_threads = 0;  ///< that read and describe scans, at most 256; 0: one a processor
  GraphOptions graph;
  DriveProgress progress = nullptr;
};

/// A scan was found where an earlier one was taken, or, with a map, in the map.
struct FoundConstraint {
  Constraint constraint;          ///< numbers of scans in the plan
  double confidence = 0.0;        ///< of the answer; 1 where the method tells none
  bool is_on = false;             ///< false: it contradicts the rest, and was switched off
  double chi2 = 0.0;              ///< of the result: squared error in its standard deviations
  Pose error = Pose::Identity();  ///< of the result: what it says, seen from where the scan is
};

/// A drive whose poses agree.
struct ClosedDrive {
  std::vector<Pose> T_map_scan;  ///< of every scan of the plan
  std::vector<FoundConstraint> constraints;
  std::size_t num_looked_at = 0;  ///< scans for which a constraint was looked for
  int num_passes = 0;
  Drift drift;
  OdometryNoise noise;  ///< of the odometry, as it was found to be

  [[nodiscard]] std::size_t num_on() const;
};

/// Closes the loops of one drive whose poses, those of the plan, are odometry: finds them with a
/// LoopDetector, in passes, since poses that contradict each other hide loops, and optimises the
/// pose graph. The first scan stays where it is. Without a loop the poses are those of the plan,
/// and there are no constraints.
///
/// The result depends on the drive alone, not on the number of threads. InvalidArgument: options,
/// plan or parameters; FailedPrecondition: the parameters do not serve the method; Cancelled.
[[nodiscard]] absl::StatusOr<ClosedDrive> CloseLoops(const Params& params,
                                                     const mapdb::SessionPlan& plan,
                                                     const mapdb::ScanLoader& load_scan,
                                                     const DriveOptions& options = {});

}  // namespace scanloc::slam
