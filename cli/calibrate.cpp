#include "cli/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_format.h"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/calibrate_map.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

/// Where the map's z is not up, which is right for some frames and seldom meant in others.
std::string UpText(const Eigen::Vector3d& up) {
  constexpr double kUsual_deg = 15.0;  // on the mean of a hill's roads
  const double off_deg = std::acos(std::clamp(up.z(), -1.0, 1.0)) * 180.0 / std::numbers::pi;
  if (off_deg < kUsual_deg) return "";
  return absl::StrFormat(
      "  up          (%.2f, %.2f, %.2f), %.0f deg off z, by the ground under the scans; if z is "
      "meant to point up, the poses' rotations are not the sensor's: quaternions with w first, or "
      "a mount that --calib or --T-base-sensor does not tell\n",
      up.x(), up.y(), up.z(), off_deg);
}

}  // namespace

absl::StatusOr<std::string> CalibrateAndTell(const std::string& path, int num_threads, bool quiet) {
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(path));
  if (!info.params.structure.enabled) {
    return "  confidence  none: the map holds no structures (--no-keep-scans)\n";
  }
  Progress progress("calibration trials", quiet);
  const absl::StatusOr<mapdb::CalibrateSummary> summary =
      mapdb::CalibrateMap({.path = path,
                           .num_threads = num_threads,
                           .progress =
                               [&](const mapdb::CalibrateProgress& now) {
                                 progress.Update(now.num_done, now.num_trials);
                               },
                           .is_cancelled = &Interrupted});
  progress.Clear();
  if (absl::IsCancelled(summary.status())) {
    return absl::CancelledError("interrupted while calibrating");
  }
  if (!summary.ok()) return summary.status();
  return UpText(summary->up) +
         absl::StrFormat("  confusable  %d pairs of places in %d trials (scanloc info)\n",
                         summary->num_confusable, summary->calibration.num_trials);
}

mapdb::Finish Calibrating(int num_threads, bool quiet, std::string* text) {
  return [num_threads, quiet, text](const std::string& path) {
    ASSIGN_OR_RETURN(*text, CalibrateAndTell(path, num_threads, quiet));
    return absl::OkStatus();
  };
}

}  // namespace scanloc::cli
