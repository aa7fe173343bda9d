#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::mapdb {

/// Whether the poses of a drive agree with what its scans show, found out from a sample of at most
/// 80 scans before anything is written. OK where they do, and where the scans show too little.
/// The drive is given whole, and its places are spacing_m apart: what is wrong is seen from one
/// place to the next, and told in scans.
///
/// InvalidArgument: neighbouring scans lie on each other elsewhere than their poses say, or fit
/// clearly better where a common mistake is undone; the text tells how many pairs, the worst of
/// them, and the likely cause.
/// What the loader returns as Cancelled is passed on; scans it cannot read are passed over.
[[nodiscard]] absl::Status CheckPoses(const Params& params, const SessionPlan& drive,
                                      double spacing_m, const ScanLoader& load_scan);

/// Whether a drive that is to be appended stands in the map's frame: a sample of at most 40 scans
/// is localized in the map. OK where their poses agree with the answers, and where nothing is
/// found.
///
/// InvalidArgument: the same places are found in both, but most of their poses disagree; the text
/// tells by how much. Other errors are those of LoadMap and of CheckPoses.
[[nodiscard]] absl::Status CheckFrame(const std::string& map_path, const SessionPlan& plan,
                                      const ScanLoader& load_scan);

/// Whether what a merged map is made of stands in one frame: of each part, given by how many places
/// it has, in their order, a sample of 40 to 5, the fewer the more parts there are, is localized in
/// the sessions of the other parts. OK as of CheckFrame, and where these have more sessions than a
/// prior may name.
///
/// InvalidArgument: as of CheckFrame. Other errors are those of LoadMap.
[[nodiscard]] absl::Status CheckParts(const std::string& map_path,
                                      const std::vector<std::int64_t>& num_places);

}  // namespace scanloc::mapdb
