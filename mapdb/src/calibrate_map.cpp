#include "scanloc/mapdb/calibrate_map.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map_writer.hpp"
#include "scanloc/core/structural/calibrate.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {
namespace {

constexpr int kMaxThreads = 256;
/// A file of up to so many bytes is read as a whole: its trials then read nothing twice.
constexpr std::int64_t kWholeBytes = std::int64_t{64} << 20;

// Runs all trials on threads and tells the caller's thread how far they are.
class TrialRun {
 public:
  TrialRun(const Calibrator& calibrator, const CalibrateOptions& options)
      : calibrator_(calibrator), options_(options), trials_(calibrator.num_trials()) {}

  absl::StatusOr<std::vector<Calibrator::Trial>> Run() {
    std::vector<std::thread> threads;
    const absl::Status started = Start(threads);
    if (started.ok()) ReportUntilDone();
    for (std::thread& thread : threads) thread.join();
    if (!started.ok()) return started;
    if (!error_.ok()) return error_;
    if (is_cancelled_) return absl::CancelledError("the calibration was interrupted");
    return std::move(trials_);
  }

 private:
  absl::Status Start(std::vector<std::thread>& threads) {
    const std::size_t wanted = options_.num_threads > 0
                                   ? static_cast<std::size_t>(options_.num_threads)
                                   : std::max(1U, std::thread::hardware_concurrency());
    const std::size_t num_threads =
        std::min({wanted, trials_.size(), static_cast<std::size_t>(kMaxThreads)});
    for (std::size_t i = 0; i < num_threads; ++i) {
      try {
        num_working_.fetch_add(1);
        threads.emplace_back([this] { Work(); });
      } catch (const std::system_error& error) {
        num_working_.fetch_sub(1);
        if (!threads.empty()) break;
        return absl::ResourceExhaustedError(
            absl::StrCat("cannot start a thread: ", error.what(), "; end other programs"));
      }
    }
    return absl::OkStatus();
  }

  void Work() {
    while (true) {
      if (options_.is_cancelled && options_.is_cancelled()) is_cancelled_ = true;
      const std::size_t i = next_.fetch_add(1);
      const bool is_over = is_cancelled_ || i >= trials_.size();
      absl::StatusOr<Calibrator::Trial> trial = Calibrator::Trial{};
      if (!is_over) trial = calibrator_.Run(i);
      const std::lock_guard lock(mutex_);
      if (trial.ok() && !is_over) trials_[i] = *trial;
      if (!trial.ok()) {
        error_.Update(trial.status());
        is_cancelled_ = true;
      }
      is_over ? --num_working_ : ++num_done_;
      has_news_.notify_one();
      if (is_over) return;
    }
  }

  void ReportUntilDone() {
    std::unique_lock lock(mutex_);
    for (std::size_t num_reported = 0; num_working_ > 0 || num_done_ != num_reported;) {
      has_news_.wait(lock, [&] { return num_done_ != num_reported || num_working_ == 0; });
      num_reported = num_done_;
      if (!options_.progress) continue;
      lock.unlock();
      options_.progress({num_reported, trials_.size()});
      lock.lock();
    }
  }

  const Calibrator& calibrator_;
  const CalibrateOptions& options_;
  std::vector<Calibrator::Trial> trials_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<int> num_working_ = 0;
  std::atomic<bool> is_cancelled_ = false;
  std::mutex mutex_;
  std::condition_variable has_news_;
  std::size_t num_done_ = 0;
  absl::Status error_;  // of the first trial that failed
};

absl::Status CheckCanCalibrate(const MapInfo& info, const CalibrateOptions& options) {
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
  const absl::StatusOr<MapInfo> info = ReadInfo(options.path);
  if (!info.ok()) return info.status();
  if (absl::Status status = CheckCanCalibrate(*info, options); !status.ok()) return status;
  if (info->calibration.has_value()) {
    return CalibrateSummary{*info->calibration, info->confusable.size(), true};
  }

  absl::StatusOr<Map> loaded =
      OpenMap(options.path, {.whole_bytes = kWholeBytes, .num_readers = options.num_threads});
  if (!loaded.ok()) return loaded.status();
  const auto map = std::make_shared<const Map>(*std::move(loaded));
  const Calibrator calibrator(map);
  const absl::StatusOr<std::vector<Calibrator::Trial>> trials = TrialRun(calibrator, options).Run();
  if (!trials.ok()) return trials.status();
  StoredCalibration stored;
  stored.calibration.num_trials = static_cast<std::int32_t>(trials->size());
  stored.confusable = FindConfusable(*trials);

  absl::StatusOr<MapWriter> writer = MapWriter::Open(options.path);
  if (!writer.ok()) return writer.status();
  if (writer->head().content_id != map->content_id) {
    return absl::UnavailableError(
        absl::StrCat("map '", options.path,
                     "' was written by another build meanwhile; calibrate it when that has ended"));
  }
  if (absl::Status status = writer->ReplaceCalibration(stored); !status.ok()) return status;
  if (absl::Status status = writer->Release(); !status.ok()) return status;
  return CalibrateSummary{stored.calibration, stored.confusable.size(), false};
}

}  // namespace scanloc::mapdb
