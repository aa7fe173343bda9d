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
  const absl::Status asked = proto::FromGrpc(health->Check(&context, {}, &response));
  if (asked.ok() && response.status() == HealthCheckResponse::SERVING) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat(address, " does not serve: ",
                   asked.ok() ? absl::string_view("it is starting or stopping") : asked.message()));
}

}  // namespace scanloc::server
