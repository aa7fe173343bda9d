#pragma once

#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/eval/evaluation.hpp"

namespace scanloc::cli {

/// A scan this near to a place was taken there: poses are rounded in files.
inline constexpr double kSamePlace_m = 0.01;

/// Says so on stderr if the queries are scans that the map was made of, and each may find itself.
void WarnOfOwnDrive(const std::vector<eval::EvalQuery>& queries);

/// OK if the map can be taken for one that grew as the queries were taken, else why not.
[[nodiscard]] absl::Status CheckSession(const Map& map,
                                        const std::vector<eval::EvalQuery>& queries);

}  // namespace scanloc::cli
