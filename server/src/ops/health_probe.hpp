#pragma once

#include <string>

#include "absl/status/status.h"

namespace scanloc::server {

/// How to ask a server whether it serves, for a container's health check.
struct Probe {
  std::string address;  ///< HOST:PORT

  /// PEM files. With one of the first two, over TLS. Whoever probes this machine knows whom it
  /// asks: the server's certificate is checked only where there is a CA for it, and never its host.
  std::string ca_file;
  std::string cert_file;  ///< shown where the server asks for one; with its key
  std::string key_file;
};

/// Unavailable: it does not serve, or does not answer within some seconds. InvalidArgument: a file
/// cannot be read.
[[nodiscard]] absl::Status ProbeHealth(const Probe& probe);

}  // namespace scanloc::server
