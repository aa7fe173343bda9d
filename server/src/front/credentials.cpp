#include "front/credentials.hpp"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <utility>

namespace scanloc::server {
namespace {

/// gRPC's own watcher of files takes up whatever it finds there, and then fails every handshake; so
/// it is asked to fetch what was checked, for which its C++ interface has no credentials.
class ReloadedCredentials final : public grpc::ServerCredentials {
 public:
  ReloadedCredentials(const TlsFiles& files, std::string own_client_cert)
      : files_(files),
        own_client_cert_(std::move(own_client_cert)),
        credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(
                files.is_mutual() ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                  : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
                &ReloadedCredentials::Fetch, this))) {}
  ~ReloadedCredentials() override { grpc_server_credentials_release(credentials_); }
  ReloadedCredentials(const ReloadedCredentials&) = delete;
  ReloadedCredentials& operator=(const ReloadedCredentials&) = delete;

  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {
    // Tokens are looked at with each call (Access).
  }

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  /// gRPC calls it before each handshake, one at a time.
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config) {
    auto& own = *static_cast<ReloadedCredentials*>(self);
    std::shared_ptr<const TlsMaterial> now = own.files_.Current();
    if (now == own.given_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair = {now->key.c_str(), now->cert.c_str()};
    // gRPC 1.51 ends the process where there is no CA at all; without one for clients, they are not
    // asked for a certificate, and what stands here is not looked at.
    const std::string client_ca =
        now->client_ca.empty() ? now->cert : now->client_ca + "\n" + own.own_client_cert_;
    *config = grpc_ssl_server_certificate_config_create(client_ca.c_str(), &pair, 1);
    own.given_ = std::move(now);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const TlsFiles& files_;
  const std::string own_client_cert_;
  std::shared_ptr<const TlsMaterial> given_;
  grpc_server_credentials* const credentials_;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> MakeCredentials(const TlsFiles* files,
                                                         const std::string& own_client_cert) {
  if (files == nullptr) return grpc::InsecureServerCredentials();
  return std::make_shared<ReloadedCredentials>(*files, own_client_cert);
}

}  // namespace scanloc::server
