#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "kinds.hpp"

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

absl::StatusOr<std::unique_ptr<Store>> OpenStore(const std::string& url,
                                                 const StoreOptions& options) {
  for (const char* scheme : {"http://", "https://", "s3://"}) {
    if (absl::StartsWith(url, scheme)) return OpenHttpStore(url, options);
  }
  if (url.empty() || absl::StrContains(url, "://")) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the store '", url, "' is neither s3://BUCKET, http(s)://HOST/PATH nor a folder"));
  }
  return OpenFolderStore(url);
}

}  // namespace scanloc::catalogue
