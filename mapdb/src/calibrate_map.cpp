#include "scanloc/mapdb/calibrate_map.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map_writer.hpp"
#include "scanloc/core/map/up.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/structural/calibrate.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {
namespace {

/// A file of up to so many bytes is read as a whole: its trials then read nothing twice.
constexpr std::int64_t kWholeBytes = std::int64_t{64} << 20;

absl::StatusOr<std::vector<Calibrator::Trial>> RunTrials(const Calibrator& calibrator,
                                                         const CalibrateOptions& options) {
  std::vector<Calibrator::Trial> trials(calibrator.num_trials());
  const auto run = [&](std::size_t i, std::size_t /*worker*/) {
    if (options.is_cancelled && options.is_cancelled()) {
      return absl::CancelledError("the calibration was interrupted");
    }
    const absl::StatusOr<Calibrator::Trial> trial = calibrator.Run(i);
    if (trial.ok()) trials[i] = *trial;
    return trial.status();
  };
  const auto tell = [&](std::size_t num_done) {
    if (options.progress) options.progress({num_done, trials.size()});
  };
  RETURN_IF_ERROR(RunJobs(NumThreads(options.num_threads), trials.size(), run, tell));
  return trials;
}

absl::Status CheckCanCalibrate(const FileInfo& info, const CalibrateOptions& options) {
  if (options.num_threads < 0 || options.num_threads > kMaxThreads) {
    return absl::InvalidArgumentError(absl::StrCat("num_threads is ", options.num_threads,
                                                   "; it must be in [0, ", kMaxThreads, "]"));
  }
  if (!info.params.structure.enabled) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", options.path,
                     "' holds no structures of its scans, which calibration needs; build it again "
                     "with --keep-scans"));
  }
  if (!info.complete) {
    return absl::FailedPreconditionError(absl::StrCat(
        "map '", options.path, "' is incomplete; finish its build with --resume first"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CalibrateSummary> CalibrateMap(const CalibrateOptions& options) {
  ASSIGN_OR_RETURN(const FileInfo info, ReadInfo(options.path));
  RETURN_IF_ERROR(CheckCanCalibrate(info, options));
  if (info.calibration.has_value()) {
    return CalibrateSummary{*info.calibration, info.confusable.size(), true};
  }

  ASSIGN_OR_RETURN(Map loaded, OpenMap(options.path, {.whole_bytes = kWholeBytes,
                                                      .num_readers = options.num_threads}));
  const auto map = std::make_shared<const Map>(std::move(loaded));
  const Calibrator calibrator(map);
  ASSIGN_OR_RETURN(const std::vector<Calibrator::Trial> trials, RunTrials(calibrator, options));
  StoredCalibration stored;
  stored.calibration.num_trials = static_cast<std::int32_t>(trials.size());
  stored.confusable = FindConfusable(trials);

  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(options.path));
  if (writer.head().content_id != map->content_id) {
    return absl::UnavailableError(
        absl::StrCat("map '", options.path,
                     "' was written by another build meanwhile; calibrate it when that has ended"));
  }
  RETURN_IF_ERROR(writer.ReplaceCalibration(stored));
  RETURN_IF_ERROR(writer.Release());
  return CalibrateSummary{stored.calibration, stored.confusable.size(), false,
                          FindUp(*map).value_or(Eigen::Vector3d::UnitZ())};
}

}  // namespace scanloc::mapdb
