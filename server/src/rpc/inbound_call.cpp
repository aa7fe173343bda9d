#include "rpc/inbound_call.hpp"

#include <utility>

#include "scanloc/proto/status.hpp"

namespace scanloc::server {

// Whatever is asked of a reactor before it is returned is done only then, in order.
RawService::Reactor* InboundCall::Receive(const CallWaits& waits,
                                          grpc::CallbackServerContext& context,
                                          const std::string& client, Act act, Ended ended) {
  const auto call =
      std::make_shared<InboundCall>(waits, context, client, std::move(act), std::move(ended));
  call->self_ = call;
  if (const absl::Status entered = waits.receiving.Enter(call, client); entered.ok()) {
    call->StartRead(&call->request_);
  } else {
    call->End(entered);
  }
  return call.get();
}

RawService::Reactor* InboundCall::Refuse(const CallWaits& waits,
                                         grpc::CallbackServerContext& context,
                                         const std::string& client, const absl::Status& status,
                                         Ended ended) {
  const auto call =
      std::make_shared<InboundCall>(waits, context, client, nullptr, std::move(ended));
  call->self_ = call;
  call->End(status);
  return call.get();
}

void InboundCall::End(const absl::Status& status) {
  ended_(status);
  const auto send = [&] {
    if (status.ok()) {
      StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK);
    } else {
      Finish(proto::ToGrpc(status));
    }
  };
  const std::shared_ptr<IdleCall> answer(shared_from_this(), &answer_);
  if (waits_.sending.Enter(answer, client_, send).ok()) return;
  context_->TryCancel();
  send();
}

void InboundCall::OnReadDone(bool ok) {
  if (!waits_.receiving.Leave(*this)) return;  // it has been ended
  if (!ok) return End(absl::InvalidArgumentError("the call ended without a whole request"));
  act_(*this);
}

void InboundCall::Cancel() {
  const std::lock_guard lock(mutex_);
  if (context_ != nullptr) context_->TryCancel();
}

void InboundCall::OnDone() {
  const std::shared_ptr<InboundCall> self = std::move(self_);
  (void)waits_.sending.Leave(answer_);
  const std::lock_guard lock(mutex_);
  context_ = nullptr;
}

}  // namespace scanloc::server
