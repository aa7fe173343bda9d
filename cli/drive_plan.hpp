#pragma once

#include <string>
#include <vector>

#include "cli/mount_options.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::cli {

/// The frames that are left of a drive for places at least spacing_m apart (SelectBySpacing).
[[nodiscard]] std::vector<dataset::Frame> Thinned(std::vector<dataset::Frame> frames,
                                                  double spacing_m);

/// The frames as they would become places: seen as the mount has it.
[[nodiscard]] mapdb::SessionPlan PlanOf(const std::string& name,
                                        const std::vector<dataset::Frame>& frames,
                                        const SensorMount& mount);

/// Reads the scans of the frames, which must outlive it; Cancelled once Ctrl-C was pressed.
[[nodiscard]] mapdb::ScanLoader LoaderOf(const std::vector<dataset::Frame>& frames,
                                         const SensorMount& mount);

}  // namespace scanloc::cli
