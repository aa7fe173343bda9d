#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "folder_store.hpp"
#include "http_store.hpp"
#include "scanloc/catalogue/store.hpp"

namespace scanloc::catalogue {

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
