#include "backoff.hpp"

#include <algorithm>
#include <cmath>

#include "scanloc/proto/status.hpp"

namespace scanloc::client {

std::optional<std::chrono::milliseconds> Backoff::After(const absl::Status& status) {
  ++num_attempts_;
  const std::optional<double> asked_s = proto::RetryAfter(status);
  const bool may_help =
      absl::IsUnavailable(status) || (absl::IsResourceExhausted(status) && asked_s.has_value());
  if (!may_help || num_attempts_ >= options_.max_attempts) return std::nullopt;
  const double longest_ms = std::min(
      static_cast<double>(options_.max_backoff.count()),
      static_cast<double>(options_.initial_backoff.count()) * std::pow(2.0, num_attempts_ - 1));
  // Robots that were all refused at once must not all come back at once.
  const double drawn_ms = longest_ms * (0.5 + 0.5 * draw_());
  const double asked_ms = 1000.0 * asked_s.value_or(0.0) * (1.0 + 0.5 * draw_());
  return std::chrono::milliseconds(std::llround(std::max(drawn_ms, asked_ms)));
}

}  // namespace scanloc::client
