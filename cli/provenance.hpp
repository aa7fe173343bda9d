#pragma once

#include "scanloc/report/eval_report.hpp"

namespace scanloc::cli {

/// This program, as it was called, now.
[[nodiscard]] report::Provenance MadeNow();

}  // namespace scanloc::cli
