#include "scanloc/jobs/jobs.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <future>
#include <limits>
#include <mutex>
#include <new>
#include <system_error>

#include "absl/strings/str_cat.h"

namespace scanloc {
namespace {

class JobRun {
 public:
  JobRun(std::size_t num_jobs, const NumberedJob& job) : num_jobs_(num_jobs), job_(job) {}

  absl::Status Run(std::size_t num_threads, const std::function<void(std::size_t)>& told) {
    num_working_ = num_threads;
    const auto threads = StartThreads(num_threads, [this](std::size_t worker) { Work(worker); });
    if (!threads.ok()) return threads.status();
    std::size_t num_told = 0;
    std::unique_lock lock(mutex_);
    num_working_ -= num_threads - threads->size();
    while (num_working_ > 0 || num_told < num_done_) {
      has_news_.wait(lock, [&] { return num_working_ == 0 || num_told < num_done_; });
      if (num_told == num_done_) continue;
      num_told = num_done_;
      lock.unlock();
      told(num_told);
      lock.lock();
    }
    return error_;
  }

 private:
  // An exception that left the thread would end the process.
  absl::Status Do(std::size_t number, std::size_t worker) const {
    try {
      return job_(number, worker);
    } catch (const std::bad_alloc&) {
      return absl::ResourceExhaustedError("out of memory");
    }
  }

  void Work(std::size_t worker) {
    while (true) {
      const std::size_t i = next_.fetch_add(1);
      absl::Status status;
      const bool is_over = i >= num_jobs_ || has_failed_;
      if (!is_over) status = Do(i, worker);
      const std::lock_guard lock(mutex_);
      if (!status.ok()) {
        has_failed_ = true;
        // Of several, the first in order, whichever thread was quicker.
        if (i < error_at_) error_ = status;
        error_at_ = std::min(error_at_, i);
      }
      is_over ? --num_working_ : ++num_done_;
      has_news_.notify_one();
      if (is_over) return;
    }
  }

  const std::size_t num_jobs_;
  const NumberedJob& job_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> has_failed_ = false;
  std::mutex mutex_;
  std::condition_variable has_news_;
  std::size_t num_working_ = 0;
  std::size_t num_done_ = 0;
  std::size_t error_at_ = std::numeric_limits<std::size_t>::max();
  absl::Status error_;
};

}  // namespace

std::size_t NumThreads(int asked) {
  if (asked > 0) return static_cast<std::size_t>(asked);
  return std::max(1U, std::thread::hardware_concurrency());
}

absl::StatusOr<std::vector<std::jthread>> StartThreads(
    std::size_t num_wanted, const std::function<void(std::size_t)>& work) {
  std::vector<std::jthread> threads;
  threads.reserve(num_wanted);
  try {
    while (threads.size() < num_wanted) {
      threads.emplace_back([work, worker = threads.size()] { work(worker); });
    }
  } catch (const std::system_error& error) {
    if (threads.empty()) {
      return absl::ResourceExhaustedError(
          absl::StrCat("cannot start a thread: ", error.what(), "; end other programs"));
    }
  }
  return threads;
}

absl::Status RunJobs(std::size_t num_threads, std::size_t num_jobs, const NumberedJob& job,
                     const std::function<void(std::size_t)>& told) {
  return JobRun(num_jobs, job).Run(std::min(num_threads, num_jobs), told);
}

absl::Status RunTasks(std::size_t num_threads, std::span<const std::function<void()>> tasks) {
  if (num_threads <= 1) {
    for (const auto& task : tasks) task();
    return absl::OkStatus();
  }
  const auto run = [&](std::size_t number, std::size_t /*worker*/) {
    tasks[number]();
    return absl::OkStatus();
  };
  return RunJobs(num_threads, tasks.size(), run, [](std::size_t) {});
}

void RunBoth(const std::function<void()>& first, const std::function<void()>& second) {
  std::future<void> other;
  if (std::thread::hardware_concurrency() > 1) {
    try {
      other = std::async(std::launch::async, std::ref(second));
    } catch (const std::system_error&) {
      // No further thread: done here.
    }
  }
  first();
  other.valid() ? other.get() : second();
}

}  // namespace scanloc
