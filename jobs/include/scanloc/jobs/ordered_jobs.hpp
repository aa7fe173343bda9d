#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "scanloc/jobs/jobs.hpp"

namespace scanloc {

/// Results of numbered jobs in their order, made on threads that run ahead of who takes them by no
/// more than a window.
template <typename Result>
class OrderedJobs {
 public:
  /// No two at once have the same worker, which counts from 0.
  using Job = std::function<Result(std::size_t number, std::size_t worker)>;

  /// The jobs first ... end - 1; the window is at least 1.
  OrderedJobs(std::size_t first, std::size_t end, std::size_t window, Job job)
      : job_(std::move(job)), next_claim_(first), next_take_(first), end_(end), slots_(window) {}

  /// Jobs that have not begun are not done any more.
  ~OrderedJobs() {
    {
      const std::lock_guard lock(mutex_);
      next_claim_ = end_;
    }
    may_claim_.notify_all();
  }

  /// Once. ResourceExhausted: no thread could be started.
  [[nodiscard]] absl::Status Start(std::size_t num_threads) {
    auto threads = StartThreads(num_threads, [this](std::size_t worker) { Work(worker); });
    if (!threads.ok()) return threads.status();
    threads_ = *std::move(threads);
    return absl::OkStatus();
  }

  /// The next result in order; waits for it. From one thread, and no oftener than there are jobs.
  /// Throws what its job threw.
  [[nodiscard]] Result Take() {
    std::unique_lock lock(mutex_);
    Slot& slot = slots_[next_take_ % slots_.size()];
    is_ready_.wait(lock, [&] { return slot.result.has_value() || slot.thrown != nullptr; });
    Slot taken = std::exchange(slot, {});
    ++next_take_;
    may_claim_.notify_one();
    if (taken.thrown != nullptr) std::rethrow_exception(taken.thrown);
    return *std::move(taken.result);
  }

 private:
  struct Slot {
    std::optional<Result> result;
    std::exception_ptr thrown;
  };

  void Work(std::size_t worker) {
    while (const std::optional<std::size_t> number = Claim()) {
      Slot done;
      try {
        done.result = job_(*number, worker);
      } catch (...) {  // out of this thread it would end the process
        done.thrown = std::current_exception();
      }
      const std::lock_guard lock(mutex_);
      slots_[*number % slots_.size()] = std::move(done);
      is_ready_.notify_one();
    }
  }

  std::optional<std::size_t> Claim() {
    std::unique_lock lock(mutex_);
    may_claim_.wait(
        lock, [&] { return next_claim_ == end_ || next_claim_ < next_take_ + slots_.size(); });
    if (next_claim_ == end_) return std::nullopt;
    return next_claim_++;
  }

  const Job job_;
  std::mutex mutex_;
  std::condition_variable may_claim_;
  std::condition_variable is_ready_;
  std::size_t next_claim_;
  std::size_t next_take_;
  const std::size_t end_;
  std::vector<Slot> slots_;
  std::vector<std::jthread> threads_;  // last: joined first
};

}  // namespace scanloc
