#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::catalogue {

/// Writes versions into a file, in one step: it has all of them or is as it was. ResourceExhausted:
/// it cannot be written.
[[nodiscard]] absl::Status WriteVersions(const std::string& path,
                                         const std::vector<Version>& versions);

/// What WriteVersions wrote; none where there is no file. DataLoss: something else.
[[nodiscard]] absl::StatusOr<std::vector<Version>> ReadVersions(const std::string& path);

}  // namespace scanloc::catalogue
