#include "admission/client_rates.hpp"

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// More clients than this are not kept apart: memory is bounded whoever calls.
constexpr std::size_t kMaxClients = 100'000;
constexpr std::chrono::seconds kSweepInterval(1);

}  // namespace

double ClientRates::ContentAt(const Bucket& bucket, Clock::time_point now) const {
  const std::chrono::duration<double> since = now - bucket.filled;
  return std::min(Capacity(), bucket.content + std::max(0.0, since.count()) * max_per_s_);
}

absl::Status ClientRates::Take(const std::string& client, Clock::time_point now) {
  if (max_per_s_ <= 0.0) return absl::OkStatus();
  const std::lock_guard lock(mutex_);
  if (buckets_.size() >= kMaxClients && !buckets_.contains(client)) ForgetIdle(now);
  Bucket& bucket = buckets_.try_emplace(client, Bucket{Capacity(), now}).first->second;
  bucket.content = ContentAt(bucket, now);
  bucket.filled = std::max(bucket.filled, now);
  if (bucket.content >= 1.0) {
    bucket.content -= 1.0;
    return absl::OkStatus();
  }
  return proto::WithRetryAfter(
      proto::WithReason(
          v1::ERROR_REASON_RATE_LIMITED,
          absl::ResourceExhaustedError(absl::StrCat(
              "more than ", max_per_s_, " requests a second of one client; wait before the next"))),
      (1.0 - bucket.content) / max_per_s_);
}

void ClientRates::ForgetIdle(Clock::time_point now) {
  // A full bucket is what a stranger gets, too.
  if (now >= next_sweep_) {
    next_sweep_ = now + kSweepInterval;
    std::erase_if(buckets_,
                  [&](const auto& entry) { return ContentAt(entry.second, now) >= Capacity(); });
  }
  if (buckets_.size() >= kMaxClients) buckets_.erase(buckets_.begin());
}

std::size_t ClientRates::num_clients() const {
  const std::lock_guard lock(mutex_);
  return buckets_.size();
}

}  // namespace scanloc::server
