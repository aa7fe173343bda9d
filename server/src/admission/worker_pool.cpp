#include "scanloc/server/worker_pool.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <new>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Weight of the newest task in the moving average of their times.
constexpr double kNewest = 0.05;
/// Outside, clients take turns by places, not by time.
constexpr double kOnePlace = 1.0;
/// A client that comes back sooner would only find the same queue.
constexpr double kMinRetry_s = 0.05;

absl::Status OutOfMemory() {
  return absl::ResourceExhaustedError("the server is out of memory; try again later");
}

/// Beside the workers, for gRPC and all else: what gRPC cannot start it waits for, for ever.
constexpr int kSpareThreads = 32;

/// Throws std::system_error if there can be no so many more threads.
void CheckRoomForThreads(int count) {
  std::promise<void> over;
  const std::shared_future<void> is_over = over.get_future().share();
  std::vector<std::thread> threads;
  const auto finish = [&] {
    over.set_value();
    for (std::thread& thread : threads) thread.join();
  };
  try {
    for (int i = 0; i < count; ++i) threads.emplace_back([is_over] { is_over.wait(); });
  } catch (const std::system_error&) {
    finish();
    throw;
  }
  finish();
}

}  // namespace

WorkerPool::WorkerPool(int num_threads, int max_inflight, double max_wait_s)
    : max_inflight_(max_inflight), max_wait_s_(max_wait_s) {
  threads_.reserve(num_threads);
  try {
    for (int worker = 0; worker < num_threads; ++worker) {
      threads_.emplace_back([this, worker] { Run(worker); });
    }
    CheckRoomForThreads(kSpareThreads);
  } catch (const std::system_error& error) {
    const std::size_t num_started = threads_.size();
    Finish();
    throw std::system_error(
        error.code(),
        absl::StrCat("cannot start ", num_threads,
                     " threads that answer queries, and some for all else; ", num_started,
                     " were possible: ask for fewer (--threads), or "
                     "raise the limits of memory or processes (ulimit -v, -u)"));
  }
}

WorkerPool::~WorkerPool() { Finish(); }

void WorkerPool::Finish() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  has_work_.notify_all();
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

absl::Status WorkerPool::Submit(const std::string& client, Task task) {
  Task displaced;
  absl::Status busy;
  absl::Status taken;
  {
    const std::lock_guard lock(mutex_);
    if (!HasRoom()) {
      busy = BusyError();
      displaced = waiting_.TakeLastFor(client);
      if (!displaced) return busy;
    }
    try {
      waiting_.Add({client, std::move(task)});
    } catch (const std::bad_alloc&) {
      taken = OutOfMemory();
    }
  }
  has_work_.notify_one();
  if (displaced) displaced(busy);
  return taken;
}

void WorkerPool::SubmitPatiently(const std::string& client, Task task) {
  Task refused;
  {
    const std::lock_guard lock(mutex_);
    patient_.Add({client, std::move(task)});
    refused = LetPatientIn();  // else whoever is done next does
  }
  has_work_.notify_one();
  if (refused) refused(OutOfMemory());
}

absl::Status WorkerPool::CheckRoomFor(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  return HasRoom() || waiting_.HasToSpareFor(client) ? absl::OkStatus() : BusyError();
}

bool WorkerPool::HasRoom() const {
  return waiting_.size() + num_running_ < max_inflight_ && Wait_s() <= max_wait_s_;
}

WorkerPool::Task WorkerPool::LetPatientIn() {
  if (patient_.size() == 0) return nullptr;
  const bool is_idle = waiting_.size() == 0 && num_running_ < static_cast<int>(threads_.size());
  if (!is_idle && !HasRoom()) return nullptr;
  is_turn_of_patient_ = !is_turn_of_patient_;
  if (!is_idle && !is_turn_of_patient_) return nullptr;
  FairQueue::Turn turn = patient_.TakeNext(kOnePlace);
  try {
    waiting_.Add(std::move(turn));
  } catch (const std::bad_alloc&) {
    return std::move(turn.task);
  }
  return nullptr;
}

double WorkerPool::Wait_s() const {
  return mean_task_s_ * waiting_.size() /
         static_cast<double>(std::max<std::size_t>(1, threads_.size()));
}

absl::Status WorkerPool::BusyError() const {
  return proto::WithRetryAfter(absl::ResourceExhaustedError(absl::StrCat(
                                   "the server is busy with ", waiting_.size() + num_running_,
                                   " queries, its limit; try again later")),
                               std::max(kMinRetry_s, Wait_s()));
}

void WorkerPool::Run(int worker) {
  std::unique_lock lock(mutex_);
  while (true) {
    has_work_.wait(lock, [this] { return stopping_ || waiting_.size() > 0; });
    if (waiting_.size() == 0) return;
    const double expected_s = mean_task_s_;
    auto [client, task] = waiting_.TakeNext(expected_s);
    ++num_running_;
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    try {
      task(worker);
    } catch (const std::exception& error) {
      spdlog::error("a query was given up: {}", error.what());
    }
    // The task's captures go before it counts as done.
    task = nullptr;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    lock.lock();
    waiting_.Correct(client, taken.count() - expected_s);
    mean_task_s_ += kNewest * (taken.count() - mean_task_s_);
    --num_running_;
    if (Task refused = LetPatientIn()) {
      lock.unlock();
      refused(OutOfMemory());
      refused = nullptr;
      lock.lock();
    }
  }
}

WorkerPool::Load WorkerPool::load() const {
  const std::lock_guard lock(mutex_);
  return {.num_waiting = waiting_.size(), .num_running = num_running_};
}

}  // namespace scanloc::server
