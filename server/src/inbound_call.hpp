#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "raw_service.hpp"
#include "waiting_room.hpp"

namespace scanloc::server {

/// A call of one request and one response, of a RawService. Lives until gRPC is done with it.
class InboundCall final : public RawService::Reactor,
                          public Waiter,
                          public std::enable_shared_from_this<InboundCall> {
 public:
  /// Gets the call once its request is there, and must end it, then or later, on any thread.
  using Act = absl::AnyInvocable<void(InboundCall& call)>;
  /// Told once how the call ended.
  using Ended = absl::AnyInvocable<void(const absl::Status& status)>;

  /// Receives the request, waiting for it in the room, which must outlive the call. If it does not
  /// come the call ends without `act`.
  [[nodiscard]] static RawService::Reactor* Receive(WaitingRoom& room, const std::string& client,
                                                    Act act, Ended ended);

  /// Ends a call with an error, its request unreceived.
  [[nodiscard]] static RawService::Reactor* Refuse(const absl::Status& status, Ended ended);

  [[nodiscard]] const grpc::ByteBuffer& request() const { return request_; }
  [[nodiscard]] grpc::ByteBuffer* response() { return &response_; }

  /// Sends the response, or the error. The call may be gone when this returns.
  void End(const absl::Status& status);

  void OnReadDone(bool ok) override;
  void OnDone() override;

  /// Use the functions above.
  InboundCall(WaitingRoom* room, Act act, Ended ended)
      : room_(room), act_(std::move(act)), ended_(std::move(ended)) {}

 private:
  void OnPutOut(const absl::Status& why) override { End(why); }

  WaitingRoom* const room_;
  Act act_;
  Ended ended_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  std::shared_ptr<InboundCall> self_;
};

}  // namespace scanloc::server
