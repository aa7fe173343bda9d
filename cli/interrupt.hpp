#pragma once

namespace scanloc::cli {

/// From now on, the first Ctrl-C or SIGTERM only makes Interrupted() true; a second one ends the
/// process as always.
void CatchInterrupts();

/// Whether one came. Any thread.
[[nodiscard]] bool Interrupted();

}  // namespace scanloc::cli
