#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <mutex>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "raw_service.hpp"
#include "waiting_room.hpp"

namespace scanloc::server {

/// Where calls wait for their clients: to send the request, and to take in the answer.
struct CallRooms {
  WaitingRoom& inbox;
  WaitingRoom& outbox;  ///< has a grace, so that to enter it puts nobody out
};

/// A call of one request and one response, of a RawService. Lives until gRPC is done with it. A
/// client that does not take in its answer before the outbox puts it out gets none.
class InboundCall final : public RawService::Reactor,
                          public Waiter,
                          public std::enable_shared_from_this<InboundCall> {
 public:
  /// Gets the call once its request is there, and must end it, then or later, on any thread.
  using Act = absl::AnyInvocable<void(InboundCall& call)>;
  /// Told once how the call ended.
  using Ended = absl::AnyInvocable<void(const absl::Status& status)>;

  /// Receives the request, waiting for it in the inbox; the rooms must outlive the call. If it does
  /// not come the call ends without `act`.
  [[nodiscard]] static RawService::Reactor* Receive(const CallRooms& rooms,
                                                    grpc::CallbackServerContext& context,
                                                    const std::string& client, Act act,
                                                    Ended ended);

  /// Ends a call with an error, its request unreceived.
  [[nodiscard]] static RawService::Reactor* Refuse(const CallRooms& rooms,
                                                   grpc::CallbackServerContext& context,
                                                   const std::string& client,
                                                   const absl::Status& status, Ended ended);

  [[nodiscard]] const grpc::ByteBuffer& request() const { return request_; }
  [[nodiscard]] grpc::ByteBuffer* response() { return &response_; }

  /// Sends the response, or the error. The call may be gone when this returns.
  void End(const absl::Status& status);

  void OnReadDone(bool ok) override;
  void OnDone() override;

  /// Use the functions above.
  InboundCall(const CallRooms& rooms, grpc::CallbackServerContext& context, std::string client,
              Act act, Ended ended)
      : rooms_(rooms),
        client_(std::move(client)),
        act_(std::move(act)),
        ended_(std::move(ended)),
        context_(&context) {}

 private:
  /// The wait for the client to take in the answer. Another waiter than the call, which may still
  /// be told of its request.
  class Answer final : public Waiter {
   public:
    explicit Answer(InboundCall& call) : call_(call) {}

   private:
    void OnPutOut(const absl::Status&) override { call_.Cancel(); }
    InboundCall& call_;
  };

  void OnPutOut(const absl::Status& why) override { End(why); }
  void Cancel();

  const CallRooms rooms_;
  const std::string client_;
  Act act_;
  Ended ended_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  Answer answer_{*this};
  std::mutex mutex_;
  grpc::CallbackServerContext* context_;  // until gRPC is done with it
  std::shared_ptr<InboundCall> self_;     // likewise
};

}  // namespace scanloc::server
