#include <openssl/evp.h>

#include <array>
#include <memory>

#include "absl/strings/escaping.h"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::catalogue {
namespace {

absl::StatusOr<std::string> HashOfFile(const std::string& path, const EVP_MD* kind) {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> hash(EVP_MD_CTX_new(),
                                                                     EVP_MD_CTX_free);
  if (hash == nullptr || EVP_DigestInit_ex(hash.get(), kind, nullptr) != 1) {
    return absl::InternalError("OpenSSL does not have the hash");
  }
  RETURN_IF_ERROR(ReadBlocks(path, [&](std::string_view block) {
    EVP_DigestUpdate(hash.get(), block.data(), block.size());
    return absl::OkStatus();
  }));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest = {};
  unsigned size = 0;
  EVP_DigestFinal_ex(hash.get(), digest.data(), &size);
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), size});
}

}  // namespace

absl::StatusOr<std::string> Sha256OfFile(const std::string& path) {
  return HashOfFile(path, EVP_sha256());
}

absl::StatusOr<std::string> Md5OfFile(const std::string& path) {
  return HashOfFile(path, EVP_md5());
}

}  // namespace scanloc::catalogue
