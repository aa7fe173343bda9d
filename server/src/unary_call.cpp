#include "unary_call.hpp"

#include <chrono>

namespace scanloc::server {

absl::Status CheckStillWanted(const grpc::CallbackServerContext& context) {
  if (context.IsCancelled()) return absl::CancelledError("the caller has hung up");
  if (context.deadline() <= std::chrono::system_clock::now()) {
    return absl::DeadlineExceededError("the deadline passed before the query could start");
  }
  return absl::OkStatus();
}

std::string AddressOf(const grpc::CallbackServerContext& context) {
  const std::string peer = context.peer();
  return peer.substr(0, peer.rfind(':'));
}

}  // namespace scanloc::server
