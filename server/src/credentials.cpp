#include "credentials.hpp"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

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

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeCredentials(
    const TlsOptions& options) {
  if (!options.enabled()) return grpc::InsecureServerCredentials();
  absl::Status status = CheckPem(options.cert_file, "the certificate");
  status.Update(CheckPem(options.key_file, "the private key"));
  const bool is_mutual = !options.client_ca_file.empty();
  if (is_mutual) status.Update(CheckPem(options.client_ca_file, "the clients' CA"));
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
