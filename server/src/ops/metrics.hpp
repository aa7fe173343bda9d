#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
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

  /// look may be called from other threads, by Text.
  explicit Metrics(std::function<Gauges()> look);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// One call that has ended, or one request of a stream that was answered. map and outcome: of the
  /// answer, empty and "none" where there is none. seconds: from request to answer; none where that
  /// means nothing.
  void CountCall(const std::string& method, absl::StatusCode code, const std::string& map,
                 const std::string& outcome, std::optional<double> seconds);
  void AddReply(const LocalizeReply& reply);
  void CountRejected(const std::string& reason);
  void CountCaptured(bool kept);
  void SetLoadTime(const std::string& map, double seconds);
  void CountFailedLoad(const std::string& map);
  /// So many places of the map in service were found sound.
  void SetChecked(const std::string& map, std::size_t num_places);
  /// A map was taken out of service because its file is damaged.
  void CountDamaged(const std::string& map);

  /// The counts of failures stand at 0 from then on, so that the first one is seen as a rise.
  void StartCountingLoads(const std::string& map);
  void StartCountingTlsReloads();

  /// The front was made anew, for this reason (Watchdog).
  void CountFrontMadeAnew(const std::string& reason);

  /// The server has asked itself for its health.
  void CountSelfCheck(bool is_answered);

  void CountFailedTlsReload();
  void SetTlsExpiry(std::int64_t unix_s);

  /// Whether what a file of that name holds is unknown: it cannot be read, or is bad.
  void SetFileUnusable(const std::string& file, bool is_unusable);

  /// All of it in Prometheus' text format.
  [[nodiscard]] std::string Text() const;

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace scanloc::server
