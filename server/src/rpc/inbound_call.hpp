#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <mutex>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "admission/idle_calls.hpp"
#include "rpc/raw_service.hpp"

namespace scanloc::server {

/// The time that clients have to send a request and to take in the answer.
struct CallWaits {
  IdleCalls& receiving;
  IdleCalls& sending;  ///< has a grace, so that to enter it evicts nobody
};

/// A call of one request and one response, of a RawService. Lives until gRPC is done with it. A
/// client that does not take in its answer in time gets none.
class InboundCall final : public RawService::Reactor,
                          public IdleCall,
                          public std::enable_shared_from_this<InboundCall> {
 public:
  /// Gets the call once its request is there, and must end it, then or later, on any thread.
  using Act = absl::AnyInvocable<void(InboundCall& call)>;
  /// Told once how the call ended.
  using Ended = absl::AnyInvocable<void(const absl::Status& status)>;

  /// Receives the request, among waits.receiving; the waits must outlive the call. If it does
  /// not come the call ends without `act`.
  [[nodiscard]] static RawService::Reactor* Receive(const CallWaits& waits,
                                                    grpc::CallbackServerContext& context,
                                                    const std::string& client, Act act,
                                                    Ended ended);

  /// Ends a call with an error, its request unreceived.
  [[nodiscard]] static RawService::Reactor* Refuse(const CallWaits& waits,
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
  InboundCall(const CallWaits& waits, grpc::CallbackServerContext& context, std::string client,
              Act act, Ended ended)
      : waits_(waits),
        client_(std::move(client)),
        act_(std::move(act)),
        ended_(std::move(ended)),
        context_(&context) {}

 private:
  /// The wait for the client to take in the answer. Not the call itself, which may still
  /// be told of its request.
  class Answer final : public IdleCall {
   public:
    explicit Answer(InboundCall& call) : call_(call) {}

   private:
    void OnEvicted(const absl::Status&) override { call_.Cancel(); }
    InboundCall& call_;
  };

  void OnEvicted(const absl::Status& why) override { End(why); }
  void Cancel();

  const CallWaits waits_;
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
