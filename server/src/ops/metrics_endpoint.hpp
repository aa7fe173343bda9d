#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "ops/metrics.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::server {

/// Serves Metrics over HTTP at /metrics, on one thread that never waits for a client: however many
/// are slow, the next one is answered. Of more than kMaxClients at once the one that came first is
/// hung up on, and so is each that takes longer than it may.
class MetricsEndpoint {
 public:
  static constexpr std::size_t kMaxClients = 64;
  static constexpr std::chrono::seconds kMaxRequestTime{2};
  static constexpr std::chrono::seconds kMaxTime{10};  ///< until all of the answer is read

  /// HOST:PORT; port 0 takes a free one. The metrics must outlive the endpoint. Unavailable: cannot
  /// listen there.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Listen(
      const std::string& address, const Metrics& metrics);
  ~MetricsEndpoint();
  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;

  /// HOST:PORT with the port that was really taken.
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  using Clock = std::chrono::steady_clock;

  struct Client {
    explicit Client(int descriptor) : socket(descriptor) {}
    FileDescriptor socket;
    Clock::time_point came = Clock::now();
    std::string request;
    std::string answer;  // what is left of it; empty until the request is there
    bool is_over = false;
  };

  MetricsEndpoint(const Metrics& metrics, int stop) : metrics_(metrics), stop_(stop) {}

  void Run();
  void TakeClients(int listening);
  void Read(Client& client) const;
  static void Write(Client& client);
  [[nodiscard]] std::string AnswerTo(const std::string& request) const;

  const Metrics& metrics_;
  std::list<FileDescriptor> listening_;  // set before the thread runs
  const FileDescriptor stop_;            // an eventfd
  std::string address_;
  bool is_short_of_descriptors_ = false;  // of the thread
  std::list<Client> clients_;             // of the thread; who came first is first
  std::thread thread_;
};

}  // namespace scanloc::server
