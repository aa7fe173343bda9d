#pragma once

#include "absl/status/statusor.h"
#include "http_server.hpp"

namespace scanloc::web {

/// Raises the number of files that the process may have open as far as it may go, and tells how
/// many connections of guests it then has room for, beside those to the server: at most
/// options.max_connections. gRPC ends the process that has no descriptor left for it.
/// FailedPrecondition: too few for any use.
[[nodiscard]] absl::StatusOr<int> ConnectionsThatFit(const HttpOptions& options);

}  // namespace scanloc::web
