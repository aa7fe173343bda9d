#pragma once

#include <string>

#include "scanloc/mapdb/history.hpp"
#include "scanloc/report/eval_report.hpp"

namespace scanloc::cli {

/// This program, as it was called, now.
[[nodiscard]] report::Provenance MadeNow();

/// What a map's history says of a command of this moment.
[[nodiscard]] mapdb::HistoryEntry MadeNow(std::string command);

}  // namespace scanloc::cli
