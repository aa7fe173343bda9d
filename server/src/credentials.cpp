#include "credentials.hpp"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <fstream>
#include <iterator>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace scanloc::server {
namespace {

constexpr unsigned kRefresh_s = 5;

/// gRPC only logs that a file is bad, and then refuses every connection.
absl::Status CheckPem(const std::string& path, const char* what) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) {
    return absl::InvalidArgumentError(absl::StrCat("cannot read ", what, " '", path, "'"));
  }
  if (absl::StrContains(text, "-----BEGIN ")) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(what, " '", path, "' is not in PEM format"));
}

/// A pair that does not match would make every handshake fail, with nothing said.
absl::Status CheckPair(const TlsOptions& options) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()),
                                                                  &SSL_CTX_free);
  const bool belongs =
      context != nullptr &&
      SSL_CTX_use_certificate_chain_file(context.get(), options.cert_file.c_str()) == 1 &&
      SSL_CTX_use_PrivateKey_file(context.get(), options.key_file.c_str(), SSL_FILETYPE_PEM) == 1 &&
      SSL_CTX_check_private_key(context.get()) == 1;
  ERR_clear_error();
  if (belongs) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the private key '", options.key_file,
                                                 "' does not belong to the certificate '",
                                                 options.cert_file, "', or one is damaged"));
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeCredentials(
    const TlsOptions& options) {
  if (!options.enabled()) return grpc::InsecureServerCredentials();
  absl::Status status = CheckPem(options.cert_file, "the certificate");
  status.Update(CheckPem(options.key_file, "the private key"));
  const bool is_mutual = !options.client_ca_file.empty();
  if (is_mutual) status.Update(CheckPem(options.client_ca_file, "the clients' CA"));
  if (status.ok()) status = CheckPair(options);
  if (!status.ok()) return status;

  grpc::experimental::TlsServerCredentialsOptions credentials(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
          options.key_file, options.cert_file, options.client_ca_file, kRefresh_s));
  credentials.watch_identity_key_cert_pairs();
  if (is_mutual) {
    credentials.watch_root_certs();
    credentials.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(credentials);
}

}  // namespace scanloc::server
