#include "rpc/health_service.hpp"

#include <cstddef>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "rpc/unary_call.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/server/server.hpp"

namespace scanloc::server {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

namespace {

// Of a watched name this much is kept, so that a watcher costs little. No service's name is as
// long.
constexpr std::size_t kMaxKeptNameBytes = 512;
constexpr double kWatchRetry_s = 5.0;
absl::Status Unknown(const std::string& service) {
  absl::string_view name = service;
  const bool is_map = absl::ConsumePrefix(&name, HealthName(""));
  return absl::NotFoundError(
      absl::StrCat(is_map ? "no map is named \"" : "no service is named \"",
                   Printable(std::string(name.substr(0, limits::kMaxNameBytes))), "\" here"));
}

/// How long one may take to arrive once the server drains.
constexpr std::chrono::seconds kReceiveGrace(1);

}  // namespace

/// One Watch stream. Only the newest status is kept for a reader that is slow; one that does not
/// read at all loses its stream. Until its request is there it is in the hands of receiving_, then
/// under the mutex of the service.
class HealthService::Watcher final : public Reactor,
                                     public IdleCall,
                                     public std::enable_shared_from_this<Watcher> {
 public:
  Watcher(HealthService& health, grpc::CallbackServerContext& context)
      : health_(health), context_(context), address_(AddressOf(context)) {}

  [[nodiscard]] const std::string& service() const { return service_; }
  [[nodiscard]] const std::string& address() const { return address_; }

  void Start() {
    self_ = shared_from_this();
    if (auto status = health_.waits_.receiving.Enter(self_, address_); !status.ok()) {
      Finish(proto::ToGrpc(status));
    } else {
      StartRead(&request_);
    }
  }

  // The next two require health_.mutex_.
  void Tell(Status status) {
    wanted_ = status;
    Proceed();
  }
  void TellLast(Status status) {
    last_ = true;
    Tell(status);
  }

  void OnReadDone(bool ok) override {
    if (!health_.waits_.receiving.Leave(*this)) return;  // it has been ended
    HealthCheckRequest request;
    absl::Status status =
        ok ? Parse(request_, &request) : absl::CancelledError("the watcher is gone");
    request_.Clear();
    const std::lock_guard lock(health_.mutex_);
    service_ = request.service().substr(0, kMaxKeptNameBytes);
    if (status.ok()) status = health_.Add(self_);
    if (!status.ok()) End(proto::ToGrpc(status));
  }

  void OnWriteDone(bool ok) override {
    (void)health_.waits_.sending.Leave(write_);
    const std::lock_guard lock(health_.mutex_);
    writing_ = false;
    if (!ok) return End({grpc::StatusCode::CANCELLED, "the watcher is gone"});
    Proceed();
  }

  void OnCancel() override {
    const std::lock_guard lock(health_.mutex_);
    if (watching_) End({grpc::StatusCode::CANCELLED, "the watcher is gone"});
  }

  void OnDone() override {
    const std::shared_ptr<Watcher> self = std::move(self_);
    const std::lock_guard lock(health_.mutex_);
    health_.Remove(self);
  }

 private:
  friend class HealthService;

  /// The wait for the watcher to take in a status.
  class Write final : public IdleCall {
   public:
    explicit Write(Watcher& watcher) : watcher_(watcher) {}

   private:
    void OnEvicted(const absl::Status&) override { watcher_.CancelWrite(); }
    Watcher& watcher_;
  };

  void OnEvicted(const absl::Status& why) override { Finish(proto::ToGrpc(why)); }

  void CancelWrite() {
    const std::lock_guard lock(health_.mutex_);
    if (writing_) context_.TryCancel();
  }

  void Proceed() {
    if (writing_ || ended_) return;
    if (!told_any_ || told_ != wanted_) {
      told_any_ = true;
      told_ = wanted_;
      HealthCheckResponse response;
      response.set_status(wanted_);
      if (auto status = Serialize(response, &response_); !status.ok()) {
        return End(proto::ToGrpc(status));
      }
      const std::shared_ptr<IdleCall> write(self_, &write_);
      const absl::Status entered = health_.waits_.sending.Enter(write, address_, [this] {
        writing_ = true;
        StartWrite(&response_);
      });
      if (!entered.ok()) End(proto::ToGrpc(entered));
    } else if (last_) {
      End({grpc::StatusCode::UNAVAILABLE, "the server is stopping"});
    }
  }

  void End(const grpc::Status& status) {
    if (std::exchange(ended_, true)) return;
    Finish(status);
  }

  HealthService& health_;
  grpc::CallbackServerContext& context_;
  const std::string address_;
  std::string service_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  Status wanted_ = HealthCheckResponse::SERVICE_UNKNOWN;
  Status told_ = HealthCheckResponse::SERVICE_UNKNOWN;
  Write write_{*this};
  bool watching_ = false;  // it is one of health_.watchers_
  bool told_any_ = false;
  bool writing_ = false;
  bool last_ = false;
  bool ended_ = false;
  std::shared_ptr<Watcher> self_;  // until gRPC is done with it
};

HealthService::HealthService(IdleCalls& sending, std::chrono::duration<double> receive)
    : receiving_(
          {.max_idle = kMaxReceiving,
           .grace = IdleCalls::kReceivedAtOnce,
           .timeout = receive,
           .full = "as many health checks as may be are on their way; try again later",
           .expired = absl::StrCat("the request did not arrive within ", receive.count(), " s")}),
      waits_{receiving_, sending} {
  using Context = grpc::CallbackServerContext;
  Serve("/grpc.health.v1.Health/Check", [this](Context* context) { return Check(context); });
  Serve("/grpc.health.v1.Health/Watch", [this](Context* context) { return Watch(context); });
}

absl::Status HealthService::Add(const std::shared_ptr<Watcher>& watcher) {
  int& num_of_address = num_by_address_[watcher->address()];
  if (static_cast<int>(watchers_.size()) >= kMaxWatchers ||
      num_of_address >= kMaxWatchersOfAddress) {
    if (num_of_address == 0) num_by_address_.erase(watcher->address());
    return proto::WithRetryAfter(
        absl::ResourceExhaustedError(absl::StrCat(
            "as many watch the health as may: ", kMaxWatchers, ", and ", kMaxWatchersOfAddress,
            " from one address; use Check, or a watch for many")),
        kWatchRetry_s);
  }
  ++num_of_address;
  watchers_.insert(watcher);
  watcher->watching_ = true;
  const auto found = statuses_.find(watcher->service());
  const Status status =
      found == statuses_.end() ? HealthCheckResponse::SERVICE_UNKNOWN : found->second;
  if (draining_) {
    watcher->TellLast(status);
  } else {
    watcher->Tell(status);
  }
  return absl::OkStatus();
}

void HealthService::Remove(const std::shared_ptr<Watcher>& watcher) {
  if (watchers_.erase(watcher) == 0) return;
  const auto count = num_by_address_.find(watcher->address());
  if (--count->second == 0) num_by_address_.erase(count);
}

void HealthService::Set(const std::string& service, bool serving) {
  const std::lock_guard lock(mutex_);
  if (draining_) return;
  const Status status = serving ? HealthCheckResponse::SERVING : HealthCheckResponse::NOT_SERVING;
  statuses_[service] = status;
  for (const std::shared_ptr<Watcher>& watcher : watchers_) {
    if (watcher->service() == service) watcher->Tell(status);
  }
}

void HealthService::StartDraining() {
  receiving_.Drain(kReceiveGrace);
  const std::lock_guard lock(mutex_);
  draining_ = true;
  for (auto& [service, status] : statuses_) status = HealthCheckResponse::NOT_SERVING;
  for (const std::shared_ptr<Watcher>& watcher : watchers_)
    watcher->TellLast(HealthCheckResponse::NOT_SERVING);
}

RawService::Reactor* HealthService::Check(grpc::CallbackServerContext* context) {
  const auto answer =
      [this](const HealthCheckRequest& request) -> absl::StatusOr<HealthCheckResponse> {
    const std::lock_guard lock(mutex_);
    const auto found = statuses_.find(request.service());
    if (found == statuses_.end()) return Unknown(request.service());
    HealthCheckResponse response;
    response.set_status(found->second);
    return response;
  };
  return InboundCall::Receive(
      waits_, *context, AddressOf(*context),
      [answer](InboundCall& call) {
        call.End(Respond<HealthCheckRequest>(call.request(), call.response(), answer));
      },
      [](const absl::Status&) {});
}

RawService::Reactor* HealthService::Watch(grpc::CallbackServerContext* context) {
  const auto watcher = std::make_shared<Watcher>(*this, *context);
  watcher->Start();
  return watcher.get();
}

}  // namespace scanloc::server
