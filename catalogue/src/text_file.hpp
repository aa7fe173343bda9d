#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace scanloc::catalogue {

/// False, with errno set, if not all of it could be written.
[[nodiscard]] bool WriteAll(int fd, absl::string_view bytes);

/// Writes a file in one step: it has all of the text or is as it was. ResourceExhausted.
[[nodiscard]] absl::Status WriteTextFile(const std::string& path, const std::string& text);

/// Empty where there is no file. Unavailable: it cannot be read, or has more than 64 MiB.
[[nodiscard]] absl::StatusOr<std::string> ReadTextFile(const std::string& path);

}  // namespace scanloc::catalogue
