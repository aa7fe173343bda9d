#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// FindProblems of map_file.hpp, for a map that is open.
[[nodiscard]] absl::StatusOr<std::vector<std::string>> FindProblems(Connection& connection);

}  // namespace scanloc::mapdb
