#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::catalogue {

/// Writes a file in one step: it has all of the text or is as it was. ResourceExhausted.
[[nodiscard]] absl::Status WriteTextFile(const std::string& path, const std::string& text);

/// Empty where there is no file. Unavailable: it cannot be read, or has more than 64 MiB.
[[nodiscard]] absl::StatusOr<std::string> ReadTextFile(const std::string& path);

}  // namespace scanloc::catalogue
