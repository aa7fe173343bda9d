#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::server {

/// Sockets that listen, and the port that they took.
struct ListenSockets {
  std::vector<int> sockets;  ///< who gets them closes them
  int port = 0;
  std::string own_address;  ///< HOST:PORT by which this machine reaches it, HOST a number
};

/// Listens at HOST:PORT: on every address that the host has, all with one port; port 0 takes a free
/// one. 0.0.0.0 and [::] both are every address of the machine. Unavailable: cannot, and why.
[[nodiscard]] absl::StatusOr<ListenSockets> ListenAt(const std::string& address);

}  // namespace scanloc::server
