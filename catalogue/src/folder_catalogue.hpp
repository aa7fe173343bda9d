#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::catalogue {

/// A catalogue in one file of a folder, written in one step under a lock; changes are found by
/// looking. For one machine, or a disk that several share.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Catalogue>> OpenFolderCatalogue(
    const std::string& folder);

}  // namespace scanloc::catalogue
