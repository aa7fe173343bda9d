#pragma once

#include <map>
#include <mutex>
#include <set>
#include <string>

#include "grpc/health/v1/health.grpc.pb.h"

namespace scanloc::server {

/// grpc.health.v1. Written here because gRPC's own says SERVING for the server as a whole from the
/// moment it listens, which is before the maps are there.
class HealthService final : public grpc::health::v1::Health::CallbackService {
 public:
  /// From then on the service is known, and watchers are told of every change.
  void Set(const std::string& service, bool serving);

  /// Everything is NOT_SERVING for good; watchers are told, and their streams end.
  void StartDraining();

  grpc::ServerUnaryReactor* Check(grpc::CallbackServerContext* context,
                                  const grpc::health::v1::HealthCheckRequest* request,
                                  grpc::health::v1::HealthCheckResponse* response) override;

  grpc::ServerWriteReactor<grpc::health::v1::HealthCheckResponse>* Watch(
      grpc::CallbackServerContext* context,
      const grpc::health::v1::HealthCheckRequest* request) override;

 private:
  using Status = grpc::health::v1::HealthCheckResponse::ServingStatus;
  class Watcher;

  std::mutex mutex_;  // guards all below and the state of every watcher
  std::map<std::string, Status> statuses_;
  std::set<Watcher*> watchers_;
  bool draining_ = false;
};

}  // namespace scanloc::server
