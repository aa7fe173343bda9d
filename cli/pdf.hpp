#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace scanloc::cli {

/// Makes NAME.pdf beside every NAME.svg of the files (WriteReport) in the folder by rsvg-convert,
/// each whole or not at all. Where there is no such program a note on standard error says so.
/// Internal: it failed, and said why on standard error.
[[nodiscard]] absl::Status MakePdfs(const std::string& folder,
                                    const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace scanloc::cli
