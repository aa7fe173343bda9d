#pragma once

#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "scanloc/server/server.hpp"

namespace scanloc::server {

/// Blocks SIGTERM, SIGINT and SIGHUP for this thread and all that it starts later, so that
/// RunUntilStopped alone sees them, those that came before, too. Call before any other thread
/// exists.
void BlockStopSignals();

/// Runs the work on a thread of its own; throws std::system_error where there can be no further
/// one.
using ThreadStarter = std::function<std::thread(std::function<void()> work)>;

/// The life of the program: loads the maps, prints `scanlocd ready on HOST:PORT`, loads them anew
/// at every SIGHUP, and shuts the server down at the first SIGTERM or SIGINT. The exit status of
/// the process: 0, or 1 after one line on stderr if no map loads. A service manager that asks is
/// told, too.
///
/// Ends the process itself where something still runs long after drain (nothing is lost by it: maps
/// are only read), and at a second signal.
int RunUntilStopped(
    Server& server, std::chrono::duration<double> drain,
    const ThreadStarter& start_thread = [](const std::function<void()>& work) {
      return std::thread(work);
    });

}  // namespace scanloc::server
