#include "cli/calibrate.hpp"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "scanloc/mapdb/calibrate_map.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {

absl::StatusOr<std::string> CalibrateAndTell(const std::string& path, int num_threads, bool quiet) {
  const absl::StatusOr<mapdb::FileInfo> info = mapdb::ReadInfo(path);
  if (!info.ok()) return info.status();
  if (!info->params.structure.enabled) {
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
  return absl::StrFormat("  confusable  %d pairs of places in %d trials (scanloc info)\n",
                         summary->num_confusable, summary->calibration.num_trials);
}

mapdb::Finish Calibrating(int num_threads, bool quiet, std::string* text) {
  return [num_threads, quiet, text](const std::string& path) {
    absl::StatusOr<std::string> told = CalibrateAndTell(path, num_threads, quiet);
    if (told.ok()) *text = *std::move(told);
    return told.status();
  };
}

}  // namespace scanloc::cli
