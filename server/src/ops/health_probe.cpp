#include "ops/health_probe.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

absl::StatusOr<std::string> ReadText(const std::string& path) {
  if (path.empty()) return std::string();
  constexpr std::int64_t kMostBytes = 16 << 20;
  absl::StatusOr<std::string> text = ReadFile(path, kMostBytes);
  if (!text.ok() || !text->empty()) return text;
  return absl::InvalidArgumentError(absl::StrCat("'", path, "' is empty"));
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(const Probe& probe) {
  namespace tls = grpc::experimental;
  if (probe.ca_file.empty() && probe.cert_file.empty()) return grpc::InsecureChannelCredentials();
  const auto ca = ReadText(probe.ca_file);
  const auto cert = ReadText(probe.cert_file);
  const auto key = ReadText(probe.key_file);
  for (const auto* file : {&ca, &cert, &key}) {
    if (!file->ok()) return file->status();
  }
  if (cert->empty() != key->empty()) {
    return absl::InvalidArgumentError("a certificate needs its private key; give both");
  }
  std::vector<tls::IdentityKeyCertPair> own;
  if (!cert->empty()) own.push_back({.private_key = *key, .certificate_chain = *cert});
  tls::TlsChannelCredentialsOptions options;
  options.set_certificate_provider(std::make_shared<tls::StaticDataCertificateProvider>(*ca, own));
  if (!own.empty()) options.watch_identity_key_cert_pairs();
  if (!ca->empty()) options.watch_root_certs();
  options.set_verify_server_certs(!ca->empty());
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<tls::NoOpCertificateVerifier>());
  return tls::TlsCredentials(options);
}

}  // namespace

absl::Status ProbeHealth(const Probe& probe) {
  using grpc::health::v1::Health;
  using grpc::health::v1::HealthCheckResponse;
  constexpr std::chrono::seconds kPatience(4);
  ASSIGN_OR_RETURN(const auto credentials, CredentialsOf(probe));
  const auto health = Health::NewStub(grpc::CreateChannel(probe.address, credentials));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  HealthCheckResponse response;
  const absl::Status asked = proto::FromGrpc(health->Check(&context, {}, &response));
  if (asked.ok() && response.status() == HealthCheckResponse::SERVING) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat(probe.address, " does not serve: ",
                   asked.ok() ? absl::string_view("it is starting or stopping") : asked.message()));
}

}  // namespace scanloc::server
