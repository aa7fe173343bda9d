#include "scanloc/server/worker_pool.hpp"

#include <utility>

#include "absl/strings/str_cat.h"

namespace scanloc::server {

WorkerPool::WorkerPool(int num_threads, int max_inflight) : max_inflight_(max_inflight) {
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

absl::Status WorkerPool::Submit(Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (num_inflight_ >= max_inflight_) {
      return absl::ResourceExhaustedError(absl::StrCat("the server is busy with ", max_inflight_,
                                                       " queries, its limit; try again later"));
    }
    waiting_.push_back(std::move(task));
    ++num_inflight_;
  }
  has_work_.notify_one();
  return absl::OkStatus();
}

void WorkerPool::Run(int worker) {
  std::unique_lock lock(mutex_);
  while (true) {
    has_work_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    Task task = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    task(worker);
    // The task's captures go before it counts as done.
    task = nullptr;
    lock.lock();
    --num_inflight_;
  }
}

}  // namespace scanloc::server
