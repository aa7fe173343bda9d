#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// Verify of map_file.hpp, for a map that is open.
[[nodiscard]] absl::StatusOr<std::vector<std::string>> Verify(Connection& connection);

}  // namespace scanloc::mapdb
