#pragma once

#include <string>

namespace scanloc::server {

/// Tells systemd, where it runs the process as a service of Type=notify, what the process is at:
/// lines such as READY=1 (sd_notify(3)). No effect where nobody asks, which is the usual case; what
/// fails is logged.
void TellServiceManager(const std::string& state);

/// Whether systemd's watchdog waits to be told WATCHDOG=1 by this process.
[[nodiscard]] bool IsServiceManagerWatching();

}  // namespace scanloc::server
