#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "scanloc/mapdb/merge_maps.hpp"

namespace scanloc::cli {

/// Calibrates a complete map, telling progress on stderr, and gives lines about it for people; one
/// line that says why not where the map holds no structures. A map that is calibrated stays so.
/// Cancelled: interrupted; the map is as it was.
[[nodiscard]] absl::StatusOr<std::string> CalibrateAndTell(const std::string& path, int num_threads,
                                                           bool quiet);

/// CalibrateAndTell of a new map before it gets its name; the lines are put in `text`.
[[nodiscard]] mapdb::Finish Calibrating(int num_threads, bool quiet, std::string* text);

}  // namespace scanloc::cli
