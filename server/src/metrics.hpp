#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/proto/messages.hpp"

namespace scanloc::server {

/// What the server counts of itself, for Prometheus; docs/operations.md tells what each means.
/// Thread-safe.
class Metrics {
 public:
  /// What is looked up when somebody asks.
  struct Gauges {
    int num_waiting = 0;
    int num_running = 0;
    int num_streams = 0;
    bool is_draining = false;
    std::vector<MapSummary> maps;
  };

  /// look may be called until StopLooking, from other threads.
  explicit Metrics(std::function<Gauges()> look);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// One call that has ended, or one request of a stream that was answered. outcome: of the answer,
  /// "none" where there is none. seconds: from request to answer; none where that means nothing.
  void CountCall(const std::string& method, absl::StatusCode code, const std::string& outcome,
                 std::optional<double> seconds);
  void AddReply(const LocalizeReply& reply);
  void CountRejected(const std::string& reason);
  void CountCaptured(bool kept);
  void SetLoadTime(const std::string& map, double seconds);
  void CountFailedLoad(const std::string& map);

  /// The counts of failures stand at 0 from then on, so that the first one is seen as a rise.
  void StartCountingLoads(const std::string& map);
  void StartCountingTlsReloads();

  void CountFailedTlsReload();
  void SetTlsExpiry(std::int64_t unix_s);

  /// All of it in Prometheus' text format.
  [[nodiscard]] std::string Text() const;

 private:
  friend class MetricsEndpoint;
  struct State;
  std::shared_ptr<State> state_;
};

/// Serves Metrics over HTTP at /metrics. A client that sends half a request is hung up on after
/// some seconds, and keeps a few others from nothing.
class MetricsEndpoint {
 public:
  /// HOST:PORT; port 0 takes a free one. Unavailable: cannot listen there.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Listen(
      const std::string& address, const Metrics& metrics);
  ~MetricsEndpoint();

  /// HOST:PORT with the port that was really taken.
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  struct Exposer;
  MetricsEndpoint() = default;
  std::string address_;
  std::unique_ptr<Exposer> exposer_;
};

}  // namespace scanloc::server
