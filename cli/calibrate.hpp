#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace scanloc::cli {

/// Calibrates a complete map, telling progress on stderr, and gives lines about it for people; one
/// line that says why not where the map holds no structures. A map that is calibrated stays so.
[[nodiscard]] absl::StatusOr<std::string> CalibrateAndTell(const std::string& path, int num_threads,
                                                           bool quiet);

}  // namespace scanloc::cli
