#include "front/tls_files.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include <ctime>
#include <functional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

template <auto Free>
struct FreeWith {
  template <typename T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Bio = std::unique_ptr<BIO, FreeWith<BIO_free>>;
using Certificate = std::unique_ptr<X509, FreeWith<X509_free>>;
using PrivateKey = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;
using Context = std::unique_ptr<SSL_CTX, FreeWith<SSL_CTX_free>>;

Bio BioOf(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

/// All that the text holds, the first of them first; none if one is damaged.
std::vector<Certificate> ParseCertificates(const std::string& text) {
  const Bio bio = BioOf(text);
  std::vector<Certificate> certificates;
  while (Certificate next{PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)}) {
    certificates.push_back(std::move(next));
  }
  const bool is_at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  ERR_clear_error();
  if (!is_at_end) certificates.clear();
  return certificates;
}

absl::Status NoCertificate(const std::string& path, const char* what) {
  return absl::InvalidArgumentError(
      absl::StrCat(what, " '", path, "' is not in PEM format, or is damaged"));
}

/// gRPC itself would only log, and then fail every handshake.
bool AreOfUse(const std::vector<Certificate>& chain, const std::string& key_text) {
  // An empty password: nobody is there to be asked for one.
  const PrivateKey key(
      PEM_read_bio_PrivateKey(BioOf(key_text).get(), nullptr, nullptr, const_cast<char*>("")));
  const Context context(SSL_CTX_new(TLS_server_method()));
  const bool are = key != nullptr && context != nullptr &&
                   SSL_CTX_use_certificate(context.get(), chain.front().get()) == 1 &&
                   SSL_CTX_use_PrivateKey(context.get(), key.get()) == 1 &&
                   SSL_CTX_check_private_key(context.get()) == 1;
  ERR_clear_error();
  return are;
}

absl::StatusOr<std::int64_t> ExpiryOf(const X509& certificate) {
  std::tm time = {};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &time) != 1) {
    return absl::InvalidArgumentError("the certificate does not say when it expires");
  }
  return timegm(&time);
}

absl::StatusOr<TlsMaterial> MaterialOf(const TlsOptions& options, const FileWatch::Texts& texts) {
  TlsMaterial found{.cert = texts[0], .key = texts[1]};
  if (texts.size() > 2) found.client_ca = texts[2];
  const std::vector<Certificate> chain = ParseCertificates(found.cert);
  if (chain.empty()) return NoCertificate(options.cert_file, "the certificate");
  if (!AreOfUse(chain, found.key)) {
    return absl::InvalidArgumentError(absl::StrCat("the private key '", options.key_file,
                                                   "' does not belong to the certificate '",
                                                   options.cert_file, "', or one is damaged"));
  }
  ASSIGN_OR_RETURN(found.expires_s, ExpiryOf(*chain.front()));
  if (!options.client_ca_file.empty() && ParseCertificates(found.client_ca).empty()) {
    return NoCertificate(options.client_ca_file, "the clients' CA");
  }
  return found;
}

std::vector<std::string> PathsOf(const TlsOptions& options) {
  std::vector<std::string> paths = {options.cert_file, options.key_file};
  if (!options.client_ca_file.empty()) paths.push_back(options.client_ca_file);
  return paths;
}

}  // namespace

TlsFiles::TlsFiles(const TlsOptions& options, Metrics& metrics)
    : options_(options),
      metrics_(metrics),
      watch_({.name = "tls",
              .paths = PathsOf(options),
              .take_up = [this](const FileWatch::Texts& texts) { return TakeUp(texts); },
              .on_trouble = [&metrics] { metrics.CountFailedTlsReload(); }}) {}

absl::StatusOr<std::unique_ptr<TlsFiles>> TlsFiles::Open(const TlsOptions& options,
                                                         Metrics& metrics) {
  auto files = std::unique_ptr<TlsFiles>(new TlsFiles(options, metrics));
  if (auto status = files->watch_.Look(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("TLS files: ", status.message()));
  }
  metrics.StartCountingTlsReloads();
  files->watch_.Start(std::bind_front(&Metrics::SetFileUnusable, &metrics));
  return files;
}

std::shared_ptr<const TlsMaterial> TlsFiles::Current() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

absl::Status TlsFiles::TakeUp(const FileWatch::Texts& texts) {
  ASSIGN_OR_RETURN(auto found, MaterialOf(options_, texts));
  spdlog::info("TLS certificate in force, good until {}",
               absl::FormatTime(absl::FromUnixSeconds(found.expires_s), absl::UTCTimeZone()));
  metrics_.SetTlsExpiry(found.expires_s);
  auto next = std::make_shared<const TlsMaterial>(std::move(found));
  const std::lock_guard lock(mutex_);
  current_.swap(next);
  return absl::OkStatus();
}

}  // namespace scanloc::server
