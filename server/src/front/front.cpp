#include "front/front.hpp"

#include <grpc/support/time.h>

#include <string>
#include <unordered_map>

#include "front/connection_limits.hpp"
#include "rpc/unary_call.hpp"

namespace scanloc::server {
namespace {

/// A client answers the server's goodbye at once, or is as good as gone.
constexpr std::chrono::seconds kMaxSilence(3);
/// For cancelled calls to tell their clients so.
constexpr std::chrono::milliseconds kCancelTime(200);

}  // namespace

/// Finds the method that a call is for.
class Front::Dispatcher final : public grpc::CallbackGenericService {
 public:
  Dispatcher(const CallWaits& waits, const std::vector<const RawService*>& services)
      : waits_(waits) {
    for (const RawService* service : services) {
      for (const auto& [path, begin] : service->methods()) methods_[path] = &begin;
    }
  }

  /// From now on calls end as soon as they begin.
  void Stop() { is_stopped_ = true; }

  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    if (is_stopped_) return Refuse(*context, absl::UnavailableError("the server is busy"));
    const auto found = methods_.find(context->method());
    if (found != methods_.end()) return (*found->second)(context);
    return Refuse(*context, absl::UnimplementedError("no such method"));
  }

 private:
  RawService::Reactor* Refuse(grpc::CallbackServerContext& context, const absl::Status& why) {
    return InboundCall::Refuse(waits_, context, AddressOf(context), why,
                               [](const absl::Status&) {});
  }

  const CallWaits waits_;
  std::unordered_map<std::string, const RawService::Begin*> methods_;
  std::atomic<bool> is_stopped_ = false;
};

absl::StatusOr<std::unique_ptr<Front>> Front::Open(Listener& listener, const CallWaits& waits,
                                                   const Options& options) {
  auto front = std::unique_ptr<Front>(new Front(listener, waits, options.services));
  grpc::ServerBuilder builder;
  builder.RegisterCallbackGenericService(front->dispatcher_.get());
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  LimitConnections(builder, options.max_memory_bytes);
  front->acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, options.credentials);
  front->server_ = builder.BuildAndStart();
  if (front->server_ == nullptr) return absl::UnavailableError("gRPC's server does not start");
  listener.LetIn([acceptor = front->acceptor_.get()](int socket) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = socket;
    acceptor->HandleNewConnection(&connection);
  });
  return front;
}

Front::Front(Listener& listener, const CallWaits& waits,
             const std::vector<const RawService*>& services)
    : listener_(listener), dispatcher_(std::make_unique<Dispatcher>(waits, services)) {}

Front::~Front() {
  HangUp();
  if (server_ != nullptr) server_->Shutdown(gpr_inf_past(GPR_CLOCK_MONOTONIC));
}

void Front::HangUp() {
  dispatcher_->Stop();
  listener_.HangUp();
}

void Front::Shutdown(std::chrono::nanoseconds patience) {
  listener_.Close(kMaxSilence, patience + kCancelTime);
  server_->Shutdown(gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                                 gpr_time_from_nanos(patience.count(), GPR_TIMESPAN)));
}

}  // namespace scanloc::server
