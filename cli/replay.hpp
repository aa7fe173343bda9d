#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/proto/messages.hpp"

namespace scanloc::cli {

/// A captured query and the name of its file.
struct ReplayedQuery {
  std::string name;
  CapturedQuery query;
};

/// The captured queries (*.query) of a folder in order of name, or the one file. NotFound: there is
/// none. InvalidArgument: a file is none, and which.
[[nodiscard]] absl::StatusOr<std::vector<std::string>> ListCapturedQueries(const std::string& path);
[[nodiscard]] absl::StatusOr<ReplayedQuery> ReadCapturedQuery(const std::string& path);

}  // namespace scanloc::cli
