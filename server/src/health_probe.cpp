#include "health_probe.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <chrono>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {

absl::Status ProbeHealth(const std::string& address) {
  using grpc::health::v1::Health;
  using grpc::health::v1::HealthCheckResponse;
  constexpr std::chrono::seconds kPatience(4);
  const auto health =
      Health::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  HealthCheckResponse response;
  const absl::Status status = proto::FromGrpc(health->Check(&context, {}, &response));
  if (status.ok() && response.status() == HealthCheckResponse::SERVING) return status;
  return absl::UnavailableError(absl::StrCat(
      address, " does not serve: ",
      status.ok() ? "it is starting or stopping" : absl::string_view(status.message())));
}

}  // namespace scanloc::server
