#include "scanloc/client/async_client.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace scanloc::client {
namespace {

using Reply = absl::StatusOr<LocalizeReply>;

/// The callback that keeps the promise of a future.
std::pair<std::future<Reply>, AsyncClient::Callback> Promise() {
  auto promise = std::make_shared<std::promise<Reply>>();
  std::future<Reply> future = promise->get_future();
  return {std::move(future), [promise](Reply reply) { promise->set_value(std::move(reply)); }};
}

}  // namespace

struct AsyncClient::State {
  struct Task {
    std::function<Reply(const LocalizationClient& client)> ask;
    Callback callback;
  };

  void Run() {
    std::unique_lock lock(mutex);
    while (true) {
      has_work.wait(lock, [this] { return is_ending || !waiting.empty(); });
      if (waiting.empty()) return;
      Task task = std::move(waiting.front());
      waiting.pop_front();
      const bool is_wanted = !is_ending;
      lock.unlock();
      task.callback(is_wanted
                        ? task.ask(*client)
                        : Reply(absl::CancelledError("the client was closed before it asked")));
      task = {};  // what the callback holds goes outside the lock
      lock.lock();
    }
  }

  void Submit(Task task) {
    std::unique_lock lock(mutex);
    if (waiting.size() < max_waiting) {
      waiting.push_back(std::move(task));
      lock.unlock();
      has_work.notify_one();
      return;
    }
    lock.unlock();
    task.callback(absl::ResourceExhaustedError(absl::StrCat(
        max_waiting, " queries wait already; ask again when some of them have ended")));
  }

  std::shared_ptr<const LocalizationClient> client;
  std::size_t max_waiting = 1;
  std::mutex mutex;
  std::condition_variable has_work;
  std::deque<Task> waiting;
  bool is_ending = false;
  std::vector<std::thread> threads;
};

AsyncClient::AsyncClient(std::shared_ptr<const LocalizationClient> client, int num_threads,
                         int max_waiting)
    : state_(std::make_unique<State>()) {
  state_->client = std::move(client);
  state_->max_waiting = static_cast<std::size_t>(std::max(1, max_waiting));
  for (int i = 0; i < std::max(1, num_threads); ++i) {
    state_->threads.emplace_back([state = state_.get()] { state->Run(); });
  }
}

AsyncClient::~AsyncClient() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_ending = true;
  }
  state_->has_work.notify_all();
  for (std::thread& thread : state_->threads) thread.join();
}

void AsyncClient::LocalizeScan(PointCloud scan, RequestOptions options, Callback callback) {
  state_->Submit(
      {[scan = std::move(scan), options = std::move(options)](const LocalizationClient& client) {
         return client.LocalizeScan(scan, options);
       },
       std::move(callback)});
}

void AsyncClient::LocalizeDescriptor(SignedDescriptor descriptor, RequestOptions options,
                                     Callback callback) {
  state_->Submit({[descriptor = std::move(descriptor),
                   options = std::move(options)](const LocalizationClient& client) {
                    return client.LocalizeDescriptor(descriptor, options);
                  },
                  std::move(callback)});
}

std::future<Reply> AsyncClient::LocalizeScan(PointCloud scan, RequestOptions options) {
  auto [future, callback] = Promise();
  LocalizeScan(std::move(scan), std::move(options), std::move(callback));
  return std::move(future);
}

std::future<Reply> AsyncClient::LocalizeDescriptor(SignedDescriptor descriptor,
                                                   RequestOptions options) {
  auto [future, callback] = Promise();
  LocalizeDescriptor(std::move(descriptor), std::move(options), std::move(callback));
  return std::move(future);
}

}  // namespace scanloc::client
