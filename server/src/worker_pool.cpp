#include "scanloc/server/worker_pool.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Weight of the newest task in the moving average of their times.
constexpr double kNewest = 0.05;
/// A client that comes back sooner would only find the same queue.
constexpr double kMinRetry_s = 0.05;

}  // namespace

WorkerPool::WorkerPool(int num_threads, int max_inflight, double max_wait_s)
    : max_inflight_(max_inflight), max_wait_s_(max_wait_s) {
  threads_.reserve(num_threads);
  for (int worker = 0; worker < num_threads; ++worker) {
    threads_.emplace_back([this, worker] { Run(worker); });
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
  {
    const std::lock_guard lock(mutex_);
    if (num_waiting_ + num_running_ >= max_inflight_ || Wait_s() > max_wait_s_) {
      busy = BusyError();
      displaced = MakeRoomFor(client);
      if (!displaced) return busy;
    }
    Queue& queue = waiting_[client];
    if (queue.empty()) turns_.push_back(client);
    queue.push_back(std::move(task));
    ++num_waiting_;
  }
  has_work_.notify_one();
  if (displaced) displaced(busy);
  return absl::OkStatus();
}

double WorkerPool::Wait_s() const {
  return mean_task_s_ * num_waiting_ /
         static_cast<double>(std::max<std::size_t>(1, threads_.size()));
}

absl::Status WorkerPool::BusyError() const {
  return proto::WithRetryAfter(absl::ResourceExhaustedError(absl::StrCat(
                                   "the server is busy with ", num_waiting_ + num_running_,
                                   " queries, its limit; try again later")),
                               std::max(kMinRetry_s, Wait_s()));
}

WorkerPool::Task WorkerPool::MakeRoomFor(const std::string& client) {
  const auto own = waiting_.find(client);
  const std::size_t num_own = own == waiting_.end() ? 0 : own->second.size();
  const auto longest = std::max_element(
      waiting_.begin(), waiting_.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (longest == waiting_.end() || longest->second.size() < num_own + 2) return nullptr;
  Task last = std::move(longest->second.back());
  longest->second.pop_back();
  --num_waiting_;
  return last;
}

WorkerPool::Task WorkerPool::TakeNext() {
  const std::string client = std::move(turns_.front());
  turns_.pop_front();
  const auto queue = waiting_.find(client);
  Task task = std::move(queue->second.front());
  queue->second.pop_front();
  if (queue->second.empty()) {
    waiting_.erase(queue);
  } else {
    turns_.push_back(client);
  }
  --num_waiting_;
  return task;
}

void WorkerPool::Run(int worker) {
  std::unique_lock lock(mutex_);
  while (true) {
    has_work_.wait(lock, [this] { return stopping_ || num_waiting_ > 0; });
    if (num_waiting_ == 0) return;
    Task task = TakeNext();
    ++num_running_;
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    task(worker);
    // The task's captures go before it counts as done.
    task = nullptr;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    lock.lock();
    mean_task_s_ += kNewest * (taken.count() - mean_task_s_);
    --num_running_;
  }
}

WorkerPool::Load WorkerPool::load() const {
  const std::lock_guard lock(mutex_);
  return {.num_waiting = num_waiting_, .num_running = num_running_};
}

}  // namespace scanloc::server
