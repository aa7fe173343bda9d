#include "tls_files.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <iterator>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

namespace scanloc::server {
namespace {

constexpr std::chrono::seconds kLookInterval(1);

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

absl::StatusOr<std::string> ReadText(const std::string& path, const char* what) {
  std::ifstream file(path);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file) return text;
  return absl::InvalidArgumentError(absl::StrCat("cannot read ", what, " '", path, "'"));
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

/// Fills in what there is, whether it is of use or not.
absl::Status Read(const TlsOptions& options, TlsMaterial& found) {
  for (const auto& [path, what, text] :
       {std::tuple(&options.cert_file, "the certificate", &found.cert),
        std::tuple(&options.key_file, "the private key", &found.key),
        std::tuple(&options.client_ca_file, "the clients' CA", &found.client_ca)}) {
    if (path->empty()) continue;
    auto read = ReadText(*path, what);
    if (!read.ok()) return read.status();
    *text = *std::move(read);
  }
  const std::vector<Certificate> chain = ParseCertificates(found.cert);
  if (chain.empty()) return NoCertificate(options.cert_file, "the certificate");
  if (!AreOfUse(chain, found.key)) {
    return absl::InvalidArgumentError(absl::StrCat("the private key '", options.key_file,
                                                   "' does not belong to the certificate '",
                                                   options.cert_file, "', or one is damaged"));
  }
  const auto expires_s = ExpiryOf(*chain.front());
  if (!expires_s.ok()) return expires_s.status();
  found.expires_s = *expires_s;
  if (!options.client_ca_file.empty() && ParseCertificates(found.client_ca).empty()) {
    return NoCertificate(options.client_ca_file, "the clients' CA");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<TlsFiles>> TlsFiles::Open(const TlsOptions& options,
                                                         Metrics& metrics) {
  TlsMaterial material;
  if (auto status = Read(options, material); !status.ok()) return status;
  auto files = std::unique_ptr<TlsFiles>(new TlsFiles(options, metrics));
  metrics.StartCountingTlsReloads();
  files->TakeUp(std::move(material));
  files->thread_ = std::thread([raw = files.get()] { raw->Watch(); });
  return files;
}

TlsFiles::~TlsFiles() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  ends_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::shared_ptr<const TlsMaterial> TlsFiles::Current() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

void TlsFiles::Watch() {
  std::unique_lock lock(mutex_);
  while (!ends_.wait_for(lock, kLookInterval, [this] { return is_ending_; })) {
    lock.unlock();
    Look();
    lock.lock();
  }
}

void TlsFiles::Look() {
  TlsMaterial found;
  if (auto status = Read(options_, found); !status.ok()) return Refuse(status, found);
  why_bad_ = absl::OkStatus();
  if (found == *Current()) return;
  spdlog::info("new TLS certificate in force, good until {}",
               absl::FormatTime(absl::FromUnixSeconds(found.expires_s), absl::UTCTimeZone()));
  TakeUp(std::move(found));
}

void TlsFiles::Refuse(const absl::Status& why, const TlsMaterial& found) {
  // At the first look an operator may just be between two files.
  if (why != why_bad_ || found != bad_) {
    why_bad_ = why;
    bad_ = found;
    is_told_ = false;
  } else if (!std::exchange(is_told_, true)) {
    metrics_.CountFailedTlsReload();
    spdlog::error("the TLS files before stay in force: {}", absl::StrCat(why.message()));
  }
}

void TlsFiles::TakeUp(TlsMaterial material) {
  metrics_.SetTlsExpiry(material.expires_s);
  const std::lock_guard lock(mutex_);
  current_ = std::make_shared<const TlsMaterial>(std::move(material));
}

}  // namespace scanloc::server
