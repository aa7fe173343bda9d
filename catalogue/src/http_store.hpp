#pragma once

#include <memory>
#include <string>

#include "scanloc/catalogue/store.hpp"

namespace scanloc::catalogue {

/// Files of a web server, or of S3.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Store>> OpenHttpStore(const std::string& url,
                                                                   const StoreOptions& options);

}  // namespace scanloc::catalogue
