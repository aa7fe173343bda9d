#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "cli/connection_options.hpp"

namespace scanloc::cli {

/// What a server tells of the map of this name, or of all its maps if the name is empty.
[[nodiscard]] absl::StatusOr<std::string> TellOfServer(const Connection& server,
                                                       const std::string& name, bool as_json);

/// How a map of the server fared in use.
[[nodiscard]] absl::StatusOr<std::string> TellHealthOnServer(const Connection& server,
                                                             const std::string& name, bool as_json);

}  // namespace scanloc::cli
