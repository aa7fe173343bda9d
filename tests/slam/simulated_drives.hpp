#pragma once

#include <string>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::slam::test {

/// A drive of some hundred metres through a town, few rays.
inline sim::SimulateOptions TownDrive(std::uint64_t town_seed, std::uint64_t session_seed) {
  sim::SimulateOptions options;
  options.town = {.town_seed = town_seed, .length_m = 900.0};
  options.session.session_seed = session_seed;
  options.session.spacing_m = 2.0;
  options.lidar.num_rays = 24;
  options.lidar.num_azimuths = 512;
  return options;
}

inline Params TownParams() {
  Params params;
  params.sensor_height_m = 1.8;
  return params;
}

inline std::vector<Pose> TruthOf(const sim::SimulatedDrive& drive) {
  std::vector<Pose> truth;
  for (std::size_t i = 0; i < drive.size(); ++i) truth.push_back(drive.T_map_sensor(i));
  return truth;
}

/// Odometry that is off by about so many per cent, in a frame of its own.
inline mapdb::SessionPlan OdometryPlan(const sim::SimulatedDrive& drive, double percent) {
  mapdb::SessionPlan plan{.name = "drive", .scans = {}};
  const std::vector<Pose> odometry =
      sim::Reckon(TruthOf(drive), percent, drive.options().session.session_seed);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    plan.scans.push_back({std::to_string(i), drive.stamp_ns(i), odometry[i]});
  }
  return plan;
}

inline mapdb::ScanLoader LoaderOf(const sim::SimulatedDrive& drive) {
  return [&drive](std::size_t i) { return drive.Scan(i); };
}

}  // namespace scanloc::slam::test
