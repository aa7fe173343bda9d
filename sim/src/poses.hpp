#pragma once

#include <vector>

#include "scanloc/core/scan/pose.hpp"
#include "scanloc/sim/simulated_drive.hpp"
#include "worlds/walk.hpp"

namespace scanloc::sim {

/// T_map_sensor of each scan of a session, in the order of the drive.
[[nodiscard]] std::vector<Pose> PosesAlong(const Town& town, const SessionOptions& options);
[[nodiscard]] std::vector<Pose> PosesAlong(const Walk& walk, const SessionOptions& options);

}  // namespace scanloc::sim
