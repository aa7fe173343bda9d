#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "grpc/health/v1/health.pb.h"
#include "rpc/inbound_call.hpp"
#include "rpc/raw_service.hpp"

namespace scanloc::server {

/// grpc.health.v1. Written here because gRPC's own says SERVING for the server as a whole from the
/// moment it listens, which is before the maps are there.
class HealthService final : public RawService {
 public:
  /// Watchers at once, and of these from one address; beyond: ResourceExhausted.
  static constexpr int kMaxWatchers = 1000;
  static constexpr int kMaxWatchersOfAddress = 100;

  /// Requests on their way that are counted (IdleCalls::Options::grace) at once. Whoever reaches
  /// the server may send them, without a token: they have places of their own, and take none
  /// of a robot's.
  static constexpr int kMaxReceiving = 32;

  /// A request may take so long to arrive. Answers wait in `sending`, which must
  /// outlive the service.
  HealthService(IdleCalls& sending, std::chrono::duration<double> receive);

  /// From then on the service is known, and watchers are told of every change.
  void Set(const std::string& service, bool serving);

  /// Everything is NOT_SERVING for good; watchers are told, and their streams end.
  void StartDraining();

 private:
  using Status = grpc::health::v1::HealthCheckResponse::ServingStatus;
  class Watcher;

  Reactor* Check(grpc::CallbackServerContext* context);
  Reactor* Watch(grpc::CallbackServerContext* context);

  /// Both with mutex_ held.
  [[nodiscard]] absl::Status Add(const std::shared_ptr<Watcher>& watcher);
  void Remove(const std::shared_ptr<Watcher>& watcher);

  IdleCalls receiving_;
  const CallWaits waits_;
  std::mutex mutex_;  // guards all below and the state of every watcher
  std::map<std::string, Status> statuses_;
  std::set<std::shared_ptr<Watcher>> watchers_;
  std::map<std::string, int> num_by_address_;  // of watchers_
  bool draining_ = false;
};

}  // namespace scanloc::server
