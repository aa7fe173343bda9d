#pragma once

#include <vector>

#include "scanloc/core/scan/pose.hpp"
#include "scanloc/sim/simulated_drive.hpp"
#include "worlds/walk.hpp"

namespace scanloc::sim {

/// T_map_sensor of each scan of a session, in the order of the drive.
[[nodiscard]] std::vector<Pose> PosesAlong(const Town& town, const SessionOptions& options);
[[nodiscard]] std::vector<Pose> PosesAlong(const Walk& walk, const SessionOptions& options);

/// The same poses as a robot reckons them that began at the first: scale, heading and height drift,
/// so that after some hundred metres about `percent` of the distance is wrong.
[[nodiscard]] std::vector<Pose> Reckon(const std::vector<Pose>& T_map_sensor, double percent,
                                       std::uint64_t seed);

}  // namespace scanloc::sim
