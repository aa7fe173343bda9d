#pragma once

#include <memory>
#include <string>

#include "scanloc/catalogue/store.hpp"

namespace scanloc::catalogue {

/// A folder, made if there is none.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Store>> OpenFolderStore(const std::string& folder);

}  // namespace scanloc::catalogue
