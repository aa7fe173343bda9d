#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"

namespace scanloc::server {

/// A fixed number of threads and a bounded number of tasks. Thread-safe.
class WorkerPool {
 public:
  /// worker is the index of the thread that runs the task, so that tasks can keep memory a thread.
  using Task = absl::AnyInvocable<void(int worker)>;

  /// Requires num_threads ≥ 1 and max_inflight ≥ 1.
  WorkerPool(int num_threads, int max_inflight);

  /// Finish.
  ~WorkerPool();

  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Takes a task, which is then certain to run; tasks start in the order taken and must not throw.
  /// ResourceExhausted at once if max_inflight tasks run or wait: the task is dropped.
  [[nodiscard]] absl::Status Submit(Task task);

  /// Runs every task that was taken, then ends the threads. No task may be submitted from then on;
  /// to be called by one thread.
  void Finish();

  [[nodiscard]] int num_threads() const { return static_cast<int>(threads_.size()); }

 private:
  void Run(int worker);

  const int max_inflight_;
  std::mutex mutex_;
  std::condition_variable has_work_;
  std::deque<Task> waiting_;
  int num_inflight_ = 0;  // waiting or running
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace scanloc::server
