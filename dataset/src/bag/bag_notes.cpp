#include "bag/bag_notes.hpp"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/median.hpp"

namespace scanloc::dataset {

std::string GapText(const std::vector<std::int64_t>& stamps_ns,
                    const std::vector<std::size_t>& without) {
  std::size_t first = without.front(), last = without.front();
  double longest_s = 0.0;
  std::size_t begin = without.front();
  for (std::size_t i = 0; i < without.size(); ++i) {
    if (i > 0 && without[i] != without[i - 1] + 1) begin = without[i];
    const double gap_s = kSPerNs * static_cast<double>(stamps_ns[without[i]] - stamps_ns[begin]);
    if (gap_s < longest_s) continue;
    longest_s = gap_s;
    first = begin;
    last = without[i];
  }
  return absl::StrFormat("the longest gap is that of clouds %d to %d, %.1f s from %.3f s on", first,
                         last, longest_s, kSPerNs * static_cast<double>(stamps_ns[first]));
}

std::string LeapText(const std::vector<Frame>& frames) {
  constexpr double kFastest_m_per_s = 100.0;
  constexpr double kLeast_m = 5.0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const double way_m =
        (frames[i].T_map_sensor.translation() - frames[i - 1].T_map_sensor.translation()).norm();
    const double time_s =
        kSPerNs * static_cast<double>(frames[i].stamp_ns - frames[i - 1].stamp_ns);
    if (way_m < kLeast_m + kFastest_m_per_s * time_s) continue;
    return absl::StrFormat(
        "the poses leap by %.1f m within %.3f s, to the cloud of %.3f s: where "
        "odometry began anew there, build what is before and after apart",
        way_m, time_s, kSPerNs * static_cast<double>(frames[i].stamp_ns));
  }
  return "";
}

std::string ContradictionText(const std::optional<FrameChain>& poses) {
  const std::size_t num = poses ? poses->NumContradicted() : 0;
  if (num == 0) return "";
  return absl::StrFormat(
      "%d poses lie elsewhere than those just before and after them say, as where two nodes tell "
      "poses, a clock was set back, or poses jump: clouds between them have none",
      num);
}

std::string SpanText(std::int64_t first_ns, std::int64_t last_ns) {
  return absl::StrFormat("%.3f to %.3f s", kSPerNs * static_cast<double>(first_ns),
                         kSPerNs * static_cast<double>(last_ns));
}

void RecordingDelay::Add(std::int64_t log_time_ns, std::int64_t stamp_ns) {
  std::int64_t delay_ns = 0;
  if (stamp_ns == 0 || __builtin_sub_overflow(log_time_ns, stamp_ns, &delay_ns)) return;
  delays_ns_.push_back(delay_ns);
}

std::optional<double> RecordingDelay::Median_s() const {
  if (delays_ns_.empty()) return std::nullopt;
  return 1e-9 * static_cast<double>(Median(delays_ns_));
}

absl::Status CheckClocks(const RecordingDelay& clouds, const RecordingDelay& poses,
                         std::vector<std::string>& notes) {
  // A SLAM that tells its poses late is no other clock, nor are poses that were added days later.
  constexpr double kLate_s = 2.0;
  constexpr double kLeastOffset_s = 10.0;
  constexpr double kMostOffset_s = 60.0;
  const std::optional<double> clouds_s = clouds.Median_s();
  const std::optional<double> poses_s = poses.Median_s();
  if (!clouds_s || !poses_s) return absl::OkStatus();
  const double offset_s = *poses_s - *clouds_s;
  if (std::abs(offset_s) < kLate_s) return absl::OkStatus();
  const std::string what =
      absl::StrFormat("by when they were recorded, clouds have stamps %.3f s %s those of the poses",
                      std::abs(offset_s), offset_s > 0.0 ? "ahead of" : "behind");
  if (std::abs(offset_s) < kLeastOffset_s || std::abs(offset_s) > kMostOffset_s) {
    notes.push_back(
        absl::StrCat(what, ": if two clocks gave them, clouds have poses of other times"));
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      what,
      ": two clocks gave them (PTP's is 37 s ahead of UTC, GPS's 18 s), and clouds would have "
      "poses of other times; set the sensor's clock, or shift the stamps of its clouds"));
}

}  // namespace scanloc::dataset
