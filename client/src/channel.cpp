#include "channel.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::client {
namespace {

/// gRPC would go on to two minutes while a server is away, and then be as late to find it back.
constexpr int kLongestReconnectBackoff_ms = 5000;

absl::StatusOr<std::string> ReadPem(const std::string& path) {
  constexpr std::int64_t kMostBytes = 4 << 20;  // more than the certificates of every CA there is
  if (path.empty()) return std::string();
  absl::StatusOr<std::string> text = ReadFile(path, kMostBytes);
  if (!text.ok()) return absl::InvalidArgumentError(text.status().message());
  if (text->find("-----BEGIN ") != std::string::npos) return text;
  return absl::InvalidArgumentError(absl::StrCat("'", path, "' is not in PEM format"));
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(
    const ClientOptions& options) {
  if (options.tls_ca_file.empty()) return grpc::InsecureChannelCredentials();
  const absl::StatusOr<std::string> ca = ReadPem(options.tls_ca_file);
  const absl::StatusOr<std::string> cert = ReadPem(options.tls_cert_file);
  const absl::StatusOr<std::string> key = ReadPem(options.tls_key_file);
  for (const auto* file : {&ca, &cert, &key}) {
    if (!file->ok()) return file->status();
  }
  return grpc::SslCredentials({*ca, *key, *cert});
}

}  // namespace

gpr_timespec ToGpr(Clock::time_point time) {
  const auto left =
      std::chrono::duration_cast<std::chrono::nanoseconds>(time - Clock::now()).count();
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(left, GPR_TIMESPAN));
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(const ClientOptions& options) {
  ASSIGN_OR_RETURN(const auto credentials, MakeCredentials(options));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestReconnectBackoff_ms);
  if (!options.tls_server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls_server_name);
  }
  return grpc::CreateCustomChannel(options.address, credentials, arguments);
}

bool AwaitReady(grpc::Channel& channel, Clock::time_point deadline) {
  while (true) {
    const grpc_connectivity_state state = channel.GetState(/*try_to_connect=*/true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (!channel.WaitForStateChange(state, ToGpr(deadline))) return false;
  }
}

}  // namespace scanloc::client
