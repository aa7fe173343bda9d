#pragma once

#include <string>

#include "absl/status/status.h"

namespace scanloc::client {

/// Why a server refused, for programs: a name of ErrorReason in
/// proto/scanloc/v1/error_details.proto without its prefix, as "MAP_LOADING". Empty where the
/// status did not come from a server.
[[nodiscard]] std::string ReasonOf(const absl::Status& status);

}  // namespace scanloc::client
