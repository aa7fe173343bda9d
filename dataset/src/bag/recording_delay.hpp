#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace scanloc::dataset {

/// How long after their stamps messages were recorded: little, or what two clocks differ by.
class RecordingDelay {
 public:
  /// Messages without a stamp say nothing.
  void Add(std::int64_t log_time_ns, std::int64_t stamp_ns);
  /// That half of the messages exceed; none without messages [s].
  [[nodiscard]] std::optional<double> Median_s() const;

 private:
  std::vector<std::int64_t> delays_ns_;
};

/// InvalidArgument, with what to do, where clouds and poses differ as clocks do that count seconds
/// otherwise: by 10 s to a minute. Where they differ otherwise, which may be the work of whoever
/// added poses to a bag, a note says so.
[[nodiscard]] absl::Status CheckClocks(const RecordingDelay& clouds, const RecordingDelay& poses,
                                       std::vector<std::string>& notes);

}  // namespace scanloc::dataset
