#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "admission/access.hpp"
#include "admission/client_rates.hpp"
#include "ops/logs.hpp"
#include "ops/metrics.hpp"
#include "scanloc/core/answer.hpp"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {

/// One call, from its arrival to the line in the log.
struct Call {
  std::string method;
  std::string request_id;  ///< the client's own if it sent one as x-request-id
  Caller caller;
  std::string client;  ///< whose turn it takes: the token's name, the certificate's, or the address
  std::int64_t arrived_ns = 0;
  bool is_stream = false;
  absl::Status admitted;
  bool is_quiet = false;  ///< one of so many failures that the log only counts it

  // Known once it is answered.
  std::string map;
  std::string content_id;
  std::optional<Outcome> outcome;
};

/// Lets calls in and sees them out: who calls, whether they may, how often; then counts and logs
/// what became of them. Thread-safe.
class Admission {
 public:
  /// Of one address: beyond it, calls without a good token are told to wait, and only counted.
  static constexpr double kMaxFailures_per_s = 10.0;

  /// All must outlive it.
  Admission(Access& access, Metrics& metrics, double max_rate_per_s, RequestLog log)
      : access_(access),
        metrics_(metrics),
        rates_(max_rate_per_s),
        log_(log),
        log_limit_(kMaxLinesPerSecond, kNsPerSecond) {
    access_.StartWatching(std::bind_front(&Metrics::SetFileUnusable, &metrics_));
  }
  ~Admission() { access_.StopWatching(); }
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  /// Names the call, tells the client that name in the initial metadata, and says in `admitted`
  /// whether it may go on.
  [[nodiscard]] Call Begin(grpc::CallbackServerContext& context, const char* method, Role role);

  /// A further request of a stream: counts against the rate, and asks whether the token is still
  /// good.
  [[nodiscard]] absl::Status AdmitNext(const Call& call);

  /// The call has ended so, or a request of its stream was answered. How long a stream was open is
  /// no time of an answer, and is left out of those.
  void End(const Call& call, const absl::Status& status);

 private:
  /// Of lines about requests; what is beyond is counted and told with the next line.
  static constexpr int kMaxLinesPerSecond = 100;
  static constexpr std::int64_t kNsPerSecond = 1'000'000'000;

  void Log(const Call& call, const absl::Status& status, double seconds);

  Access& access_;
  Metrics& metrics_;
  ClientRates rates_;
  ClientRates failures_{kMaxFailures_per_s};  // calls without a good token, by address
  const RequestLog log_;
  LogLimit log_limit_;
};

}  // namespace scanloc::server
