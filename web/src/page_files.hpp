#pragma once

#include <map>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "http_server.hpp"

namespace scanloc::web {

class Api;

/// The page as it was built (web/page), in memory.
class PageFiles {
 public:
  /// NotFound: the folder holds no page.
  [[nodiscard]] static absl::StatusOr<PageFiles> Open(const std::string& folder);

  /// Beside the program: where it was built or installed.
  [[nodiscard]] static std::string DefaultFolder();

  /// Nothing where the request is for something else.
  [[nodiscard]] std::optional<Response> Serve(const Request& request) const;

  /// The page in one file, which asks nobody: it holds what the interface tells of one map and of
  /// the last answers, each response by its path. The token is the one to ask with.
  [[nodiscard]] absl::StatusOr<std::string> Snapshot(const Api& api, const std::string& map,
                                                     const std::string& token) const;

 private:
  std::map<std::string, std::string> files_;  // by name
};

}  // namespace scanloc::web
