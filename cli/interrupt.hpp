#pragma once

namespace scanloc::cli {

/// From now on, the first Ctrl-C, SIGTERM or SIGHUP (the terminal went away), unless the caller had
/// it ignored, only makes Interrupted() true; a second one ends the process as always.
void CatchInterrupts();

/// Whether one came. Any thread.
[[nodiscard]] bool Interrupted();

}  // namespace scanloc::cli
