#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "folder_catalogue.hpp"
#include "postgres_catalogue.hpp"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::catalogue {

absl::StatusOr<std::unique_ptr<Catalogue>> OpenCatalogue(const std::string& url) {
  if (absl::StartsWith(url, "postgresql://") || absl::StartsWith(url, "postgres://")) {
    return OpenPostgresCatalogue(url);
  }
  if (url.empty() || absl::StrContains(url, "://")) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the catalogue '", url, "' is neither postgresql://USER@HOST/DATABASE nor a folder"));
  }
  return OpenFolderCatalogue(url);
}

}  // namespace scanloc::catalogue
