#pragma once

#include <grpcpp/server_context.h>

#include <memory>
#include <utility>

#include "admission/admission.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/unary_call.hpp"

namespace scanloc::server {

/// Answers a small request on the thread that brought it: act(request) makes an
/// absl::StatusOr<Response>.
template <typename Request, typename Act>
RawService::Reactor* AnswerHere(const CallWaits& waits, Admission& admission, const char* method,
                                Role role, grpc::CallbackServerContext* context, Act act) {
  const auto call = std::make_shared<Call>(admission.Begin(*context, method, role));
  auto ended = [&admission, call](const absl::Status& status) { admission.End(*call, status); };
  if (!call->admitted.ok())
    return InboundCall::Refuse(waits, *context, call->client, call->admitted, std::move(ended));
  return InboundCall::Receive(
      waits, *context, call->client,
      [act = std::move(act)](InboundCall& inbound) {
        absl::Status status = CheckSmall(inbound.request());
        if (status.ok()) status = Respond<Request>(inbound.request(), inbound.response(), act);
        inbound.End(status);
      },
      std::move(ended));
}

}  // namespace scanloc::server
