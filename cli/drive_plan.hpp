#pragma once

#include <string>
#include <vector>

#include "cli/mount_options.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::cli {

/// The frames as they would become places: seen as the mount has it.
[[nodiscard]] mapdb::SessionPlan PlanOf(const std::string& name,
                                        const std::vector<dataset::Frame>& frames,
                                        const SensorMount& mount);

/// Reads the scans of the frames, which must outlive it; Cancelled once Ctrl-C was pressed.
[[nodiscard]] mapdb::ScanLoader LoaderOf(const std::vector<dataset::Frame>& frames,
                                         const SensorMount& mount);

}  // namespace scanloc::cli
