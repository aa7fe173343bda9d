#pragma once

#include <condition_variable>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/server/fair_queue.hpp"

namespace scanloc::server {

/// A fixed number of threads and a bounded number of tasks. Clients share the threads' time, so
/// that one with many tasks or long ones does not keep the others waiting. Thread-safe.
class WorkerPool {
 public:
  /// Called once: with the index of the thread that runs it, so that tasks can keep memory a
  /// thread; or with ResourceExhausted, if it had to make room for another client's.
  using Task = FairQueue::Task;

  struct Load {
    int num_waiting = 0;
    int num_running = 0;
  };

  /// Throws std::system_error where there can be no so many threads. Requires num_threads ≥ 1 and
  /// max_inflight ≥ 1. max_wait_s: a task that would wait longer, as the ones before it last on the
  /// average, is one too many; infinite: none is.
  WorkerPool(int num_threads, int max_inflight,
             double max_wait_s = std::numeric_limits<double>::infinity());

  /// Finish.
  ~WorkerPool();

  /// Takes a task, which is then certain to be called and must not throw; those of one client start
  /// in the order taken. While max_inflight tasks run or wait, or it would wait longer than
  /// max_wait_s, ResourceExhausted at once and the task is dropped, unless another client has at
  /// least two more waiting: its last one makes room.
  /// The status holds a RetryInfo (proto/status.hpp) with the time the queue needs.
  [[nodiscard]] absl::Status Submit(const std::string& client, Task task);

  /// Takes a task even where Submit refuses it: it then waits outside until there is room, and gets
  /// at most every second place that falls free while others want it. Who calls bounds how many
  /// there are. The task may still be called with ResourceExhausted, as above.
  void SubmitPatiently(const std::string& client, Task task);

  /// What Submit would say now, for a client whose task is not there yet.
  [[nodiscard]] absl::Status CheckRoomFor(const std::string& client) const;

  /// Calls every task that was taken, then ends the threads. No task may be submitted from then on;
  /// to be called by one thread.
  void Finish();

  [[nodiscard]] int num_threads() const { return static_cast<int>(threads_.size()); }
  [[nodiscard]] Load load() const;

 private:
  void Run(int worker);
  /// All with mutex_ held.
  [[nodiscard]] Task LetPatientIn();  // a task that there was no memory for; else null
  [[nodiscard]] bool HasRoom() const;
  [[nodiscard]] absl::Status BusyError() const;

  [[nodiscard]] double Wait_s() const;  // of one more task

  const int max_inflight_;
  const double max_wait_s_;
  mutable std::mutex mutex_;
  std::condition_variable has_work_;
  FairQueue waiting_;
  FairQueue patient_;                // outside, until there is room
  bool is_turn_of_patient_ = false;  // the next place that falls free is theirs
  int num_running_ = 0;
  double mean_task_s_ = 0.01;  // moving average
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace scanloc::server
