#include "unary_call.hpp"

#include <chrono>

namespace scanloc::server {
namespace {

/// Largest request that holds neither scan nor descriptors [bytes].
constexpr std::size_t kMaxSmallRequestBytes = 4096;

}  // namespace

absl::Status CheckStillWanted(const grpc::CallbackServerContext& context) {
  if (context.IsCancelled()) return absl::CancelledError("the caller has hung up");
  if (context.deadline() <= std::chrono::system_clock::now()) {
    return absl::DeadlineExceededError("the deadline passed before the query could start");
  }
  return absl::OkStatus();
}

absl::Status CheckSmall(const grpc::ByteBuffer& request) {
  if (!request.Valid() || request.Length() <= kMaxSmallRequestBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the request has ", request.Length(),
                                                 " bytes; at most ", kMaxSmallRequestBytes,
                                                 " are allowed here"));
}

std::string AddressOf(const grpc::CallbackServerContext& context) {
  const std::string peer = context.peer();
  return peer.substr(0, peer.rfind(':'));
}

}  // namespace scanloc::server
