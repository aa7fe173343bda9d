#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "absl/status/status.h"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::sim {

/// Called as scans are written, from the thread that asked for it.
using DriveProgress = std::function<void(std::size_t num_done, std::size_t num_total)>;

/// Writes a drive as KITTI folders, the same bytes for any number of threads:
///
///   OUT/velodyne/000000.bin ...  float32 x y z intensity, intensity 0
///   OUT/times.txt                seconds, a line per scan
///   OUT/simulation.txt           the options
///   OUT/odometry.txt             the same poses as reckoned on the way; if asked for
///   OUT/rebuilt.txt              how far each scan was taken from the nearest street that was
///                                rebuilt [m]; if any was
///   OUT/poses.txt                T_map_sensor, 12 numbers a line (3×4, row-major); written last
///
/// num_threads in [1, 256]. AlreadyExists if `out` is a file or a folder that is not empty;
/// otherwise it is made. PermissionDenied, ResourceExhausted (disk full) or Unavailable if a file
/// cannot be written: the folder then holds an unfinished drive without poses.txt.
[[nodiscard]] absl::Status WriteDrive(const SimulatedDrive& drive, const std::filesystem::path& out,
                                      int num_threads, const DriveProgress& progress = {});

/// Makes the drive and writes it. InvalidArgument if an option is bad: nothing is written then.
[[nodiscard]] absl::Status Simulate(const SimulateOptions& options,
                                    const std::filesystem::path& out, int num_threads,
                                    const DriveProgress& progress = {});

}  // namespace scanloc::sim
