#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"

namespace scanloc::client {

/// Why a server refused, for programs: a name of ErrorReason in
/// proto/scanloc/v1/error_details.proto without its prefix, as "MAP_LOADING". Empty where the
/// status did not come from a server.
[[nodiscard]] std::string ReasonOf(const absl::Status& status);

/// After how long [s] a server that refused said to come back; none if it did not.
[[nodiscard]] std::optional<double> RetryAfterOf(const absl::Status& status);

}  // namespace scanloc::client
