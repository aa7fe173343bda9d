#include "health_service.hpp"

#include <cstddef>
#include <utility>

namespace scanloc::server {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

namespace {

// Of a watched name this much is kept, so that a watcher costs little. No service's name is as
// long.
constexpr std::size_t kMaxKeptNameBytes = 512;

}  // namespace

/// One Watch stream. Only the newest status is kept for a reader that is slow. Deletes itself when
/// gRPC is done with it.
class HealthService::Watcher final : public grpc::ServerWriteReactor<HealthCheckResponse> {
 public:
  Watcher(HealthService& health, std::string service)
      : health_(health), service_(std::move(service)) {}

  [[nodiscard]] const std::string& service() const { return service_; }

  // The next two require health_.mutex_.
  void Tell(Status status) {
    wanted_ = status;
    Proceed();
  }
  void TellLast(Status status) {
    last_ = true;
    Tell(status);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(health_.mutex_);
    writing_ = false;
    if (!ok) return End({grpc::StatusCode::CANCELLED, "the watcher is gone"});
    Proceed();
  }

  void OnCancel() override {
    const std::lock_guard lock(health_.mutex_);
    End({grpc::StatusCode::CANCELLED, "the watcher is gone"});
  }

  void OnDone() override {
    {
      const std::lock_guard lock(health_.mutex_);
      health_.watchers_.erase(this);
    }
    delete this;
  }

 private:
  void Proceed() {
    if (writing_ || ended_) return;
    if (!told_any_ || response_.status() != wanted_) {
      told_any_ = true;
      writing_ = true;
      response_.set_status(wanted_);
      StartWrite(&response_);
    } else if (last_) {
      End({grpc::StatusCode::UNAVAILABLE, "the server is stopping"});
    }
  }

  void End(const grpc::Status& status) {
    if (std::exchange(ended_, true)) return;
    Finish(status);
  }

  HealthService& health_;
  const std::string service_;
  HealthCheckResponse response_;
  Status wanted_ = HealthCheckResponse::SERVICE_UNKNOWN;
  bool told_any_ = false;
  bool writing_ = false;
  bool last_ = false;
  bool ended_ = false;
};

void HealthService::Set(const std::string& service, bool serving) {
  const std::lock_guard lock(mutex_);
  if (draining_) return;
  const Status status = serving ? HealthCheckResponse::SERVING : HealthCheckResponse::NOT_SERVING;
  statuses_[service] = status;
  for (Watcher* watcher : watchers_) {
    if (watcher->service() == service) watcher->Tell(status);
  }
}

void HealthService::StartDraining() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
  for (auto& [service, status] : statuses_) status = HealthCheckResponse::NOT_SERVING;
  for (Watcher* watcher : watchers_) watcher->TellLast(HealthCheckResponse::NOT_SERVING);
}

grpc::ServerUnaryReactor* HealthService::Check(grpc::CallbackServerContext* context,
                                               const HealthCheckRequest* request,
                                               HealthCheckResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const std::lock_guard lock(mutex_);
  const auto found = statuses_.find(request->service());
  if (found == statuses_.end()) {
    reactor->Finish({grpc::StatusCode::NOT_FOUND, "no such service"});
  } else {
    response->set_status(found->second);
    reactor->Finish(grpc::Status::OK);
  }
  return reactor;
}

grpc::ServerWriteReactor<HealthCheckResponse>* HealthService::Watch(
    grpc::CallbackServerContext* /*context*/, const HealthCheckRequest* request) {
  auto* watcher = new Watcher(*this, request->service().substr(0, kMaxKeptNameBytes));
  const std::lock_guard lock(mutex_);
  watchers_.insert(watcher);
  const auto found = statuses_.find(request->service());
  const Status status =
      found == statuses_.end() ? HealthCheckResponse::SERVICE_UNKNOWN : found->second;
  if (draining_) {
    watcher->TellLast(status);
  } else {
    watcher->Tell(status);
  }
  return watcher;
}

}  // namespace scanloc::server
