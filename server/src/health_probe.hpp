#pragma once

#include <string>

#include "absl/status/status.h"

namespace scanloc::server {

/// Asks the server at HOST:PORT whether it serves, without TLS: for a container's health check.
/// Unavailable: it does not, or does not answer within some seconds.
[[nodiscard]] absl::Status ProbeHealth(const std::string& address);

}  // namespace scanloc::server
