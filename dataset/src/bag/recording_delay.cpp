#include "bag/recording_delay.hpp"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/median.hpp"

namespace scanloc::dataset {

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
