#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/catalogue/store.hpp"

/// The kinds of catalogues and stores, a source each; open.cpp tells them by their URLs.
namespace scanloc::catalogue {

/// A catalogue in a PostgreSQL database. Connects when it is first asked, and anew after every
/// failure.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Catalogue>> OpenPostgresCatalogue(
    const std::string& url);

/// A catalogue in one file of a folder, written in one step under a lock; changes are found by
/// looking. For one machine, or a disk that several share.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Catalogue>> OpenFolderCatalogue(
    const std::string& folder);

/// Files of a web server, or of S3.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Store>> OpenHttpStore(const std::string& url,
                                                                   const StoreOptions& options);

/// A folder, made if there is none.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Store>> OpenFolderStore(const std::string& folder);

}  // namespace scanloc::catalogue
