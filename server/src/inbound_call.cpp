#include "inbound_call.hpp"

#include <utility>

#include "scanloc/proto/status.hpp"

namespace scanloc::server {

RawService::Reactor* InboundCall::Receive(WaitingRoom& room, const std::string& client, Act act,
                                          Ended ended) {
  const auto call = std::make_shared<InboundCall>(&room, std::move(act), std::move(ended));
  call->self_ = call;
  // Whatever is asked of a reactor before it is returned is done only then, in order.
  if (const absl::Status entered = room.Enter(call, client); entered.ok()) {
    call->StartRead(&call->request_);
  } else {
    call->End(entered);
  }
  return call.get();
}

RawService::Reactor* InboundCall::Refuse(const absl::Status& status, Ended ended) {
  const auto call = std::make_shared<InboundCall>(nullptr, nullptr, std::move(ended));
  call->self_ = call;
  call->End(status);
  return call.get();
}

void InboundCall::End(const absl::Status& status) {
  ended_(status);
  if (status.ok()) {
    StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK);
  } else {
    Finish(proto::ToGrpc(status));
  }
}

void InboundCall::OnReadDone(bool ok) {
  if (!room_->Leave(*this)) return;  // it has been ended
  if (!ok) return End(absl::InvalidArgumentError("the call ended without a whole request"));
  act_(*this);
}

void InboundCall::OnDone() { const std::shared_ptr<InboundCall> self = std::move(self_); }

}  // namespace scanloc::server
