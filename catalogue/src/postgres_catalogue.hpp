#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::catalogue {

/// A catalogue in a PostgreSQL database. Connects when it is first asked, and anew after every
/// failure.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Catalogue>> OpenPostgresCatalogue(
    const std::string& url);

}  // namespace scanloc::catalogue
