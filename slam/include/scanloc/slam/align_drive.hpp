#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/slam/close_loops.hpp"

namespace scanloc::slam {

/// So many answers must agree before a drive is taken to share something with a map.
inline constexpr std::size_t kMinAgreeing = 5;

/// Brings a drive, whose poses in the plan are odometry in a frame of its own, into the frame of a
/// map, and takes its drift out on the way: scans are localized in the map, loops are closed within
/// the drive, and all of it is one pose graph in which what is wrong is switched off.
///
/// A session named `without` is taken for absent: of a build that goes on, its own.
/// Constraints to the map have no `from`. FailedPrecondition: the drive shares nothing with the
/// map, or its answers contradict each other; the text tells what was tried. Others as of
/// CloseLoops.
[[nodiscard]] absl::StatusOr<ClosedDrive> AlignDrive(std::shared_ptr<const Map> map,
                                                     const mapdb::SessionPlan& plan,
                                                     const mapdb::ScanLoader& load_scan,
                                                     const DriveOptions& options = {},
                                                     const std::string& without = "");

}  // namespace scanloc::slam
