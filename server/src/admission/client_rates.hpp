#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <string>

#include "absl/status/status.h"

namespace scanloc::server {

/// How often each client may ask: a bucket that holds a second's worth of requests. Thread-safe.
class ClientRates {
 public:
  using Clock = std::chrono::steady_clock;

  /// 0: as often as it likes.
  explicit ClientRates(double max_per_s) : max_per_s_(max_per_s) {}

  /// ResourceExhausted, with the time until the next one, if the client has used up its share.
  [[nodiscard]] absl::Status Take(const std::string& client, Clock::time_point now = Clock::now());

  [[nodiscard]] std::size_t num_clients() const;

 private:
  struct Bucket {
    double content = 0.0;
    Clock::time_point filled;
  };

  [[nodiscard]] double Capacity() const { return std::max(1.0, max_per_s_); }
  [[nodiscard]] double ContentAt(const Bucket& bucket, Clock::time_point now) const;
  void ForgetIdle(Clock::time_point now);

  const double max_per_s_;
  mutable std::mutex mutex_;
  std::map<std::string, Bucket> buckets_;
  Clock::time_point next_sweep_;
};

}  // namespace scanloc::server
