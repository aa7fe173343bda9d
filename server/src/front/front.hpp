#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "front/listener.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/raw_service.hpp"

namespace scanloc::server {

/// gRPC's part of the server: connections, calls, and whatever memory clients make it hold. It
/// keeps nothing that is not made anew: one that is deaf, or too large, is thrown away and another
/// takes its place behind the same listener, while services, maps and workers stay.
class Front {
 public:
  struct Options {
    std::vector<const RawService*> services;
    std::shared_ptr<grpc::ServerCredentials> credentials;  ///< of this front alone
    int max_message_bytes = 0;
    std::int64_t max_memory_bytes = 0;
  };

  /// Serves whoever connects. Listener, services and waits must outlive the front. Unavailable:
  /// gRPC does not start.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Front>> Open(Listener& listener,
                                                                   const CallWaits& waits,
                                                                   const Options& options);

  /// Ends every connection and every call at once; returns when nothing of them is left.
  ~Front();
  Front(const Front&) = delete;
  Front& operator=(const Front&) = delete;

  /// Ends every connection at once, and whatever call still begins.
  void HangUp();

  /// Lets nobody in any more, waits as long as this for what is in flight, and cancels what is
  /// left. Who says nothing at all any more is not waited for.
  void Shutdown(std::chrono::nanoseconds patience);

 private:
  class Dispatcher;

  Front(Listener& listener, const CallWaits& waits, const std::vector<const RawService*>& services);

  Listener& listener_;
  const std::unique_ptr<Dispatcher> dispatcher_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace scanloc::server
