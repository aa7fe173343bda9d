#pragma once

#include <chrono>
#include <optional>

#include "absl/status/status.h"
#include "scanloc/client/client.hpp"

namespace scanloc::client {

/// When to try a call again that may safely be made twice.
class Backoff {
 public:
  /// draw gives numbers in [0, 1).
  Backoff(const RetryOptions& options, double (*draw)()) : options_(options), draw_(draw) {}

  /// How long to wait after this end of an attempt; none: do not try again. A server that is busy
  /// and says for how long is given that long at least.
  [[nodiscard]] std::optional<std::chrono::milliseconds> After(const absl::Status& status);

 private:
  const RetryOptions options_;
  double (*const draw_)();
  int num_attempts_ = 0;
};

}  // namespace scanloc::client
