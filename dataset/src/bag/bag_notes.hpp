#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/frame_tree.hpp"

namespace scanloc::dataset {

inline constexpr double kSPerNs = 1e-9;

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

/// "the longest gap is that of clouds 3 to 7, ...": of the clouds without a pose, which are given
/// by their numbers in the order of time, at least one.
[[nodiscard]] std::string GapText(const std::vector<std::int64_t>& stamps_ns,
                                  const std::vector<std::size_t>& without);

/// Says where a drive leaps from one cloud to the next, faster than anything drives, as where
/// odometry began anew; empty if it does nowhere.
[[nodiscard]] std::string LeapText(const std::vector<Frame>& frames);

/// Says how many poses are contradicted by those around them; empty if none is, or without poses.
[[nodiscard]] std::string ContradictionText(const std::optional<FrameChain>& poses);

/// "1.000 to 2.500 s".
[[nodiscard]] std::string SpanText(std::int64_t first_ns, std::int64_t last_ns);

}  // namespace scanloc::dataset
