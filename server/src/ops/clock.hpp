#pragma once

#include <chrono>
#include <cstdint>

namespace scanloc::server {

/// Monotonic [ns].
[[nodiscard]] inline std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// By the clock, since 1970 [ns].
[[nodiscard]] inline std::int64_t SinceEpochNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace scanloc::server
