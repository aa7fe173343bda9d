#pragma once

#include <string>
#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "scanloc/mapdb/history.hpp"

namespace scanloc::cli {

/// What a map's history says of a command of this moment.
[[nodiscard]] inline mapdb::HistoryEntry MadeNow(std::string command) {
  return {.when = absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", absl::Now(), absl::UTCTimeZone()),
          .command = std::move(command),
          .parents = {}};
}

}  // namespace scanloc::cli
