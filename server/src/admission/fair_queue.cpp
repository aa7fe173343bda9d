#include "scanloc/server/fair_queue.hpp"

#include <algorithm>
#include <new>

namespace scanloc::server {
namespace {

/// Beyond so many, the clients that have no task here start anew when they come back.
constexpr std::size_t kMaxAbsent = 4096;

}  // namespace

void FairQueue::Add(Turn&& turn) {
  const auto known = queues_.find(turn.client);
  if (known != queues_.end()) {
    known->second.turns.push_back(std::move(turn));
  } else {
    // What needs memory comes first: no queue may be left without a task, or a task without one.
    const auto queue = queues_.try_emplace(turn.client).first;
    try {
      queue->second.turns.push_back(std::move(turn));
    } catch (...) {
      queues_.erase(queue);
      throw;
    }
    const auto absent = absent_.extract(queue->first);
    queue->second.used_s = absent ? std::max(absent.mapped(), now_s_) : now_s_;
    queue->second.since = ++num_turns_;
  }
  ++num_tasks_;
}

FairQueue::Turn FairQueue::TakeNext(double expected_s) noexcept {
  const auto next = std::ranges::min_element(queues_, [](const auto& a, const auto& b) {
    return std::pair(a.second.used_s, a.second.since) < std::pair(b.second.used_s, b.second.since);
  });
  Queue& queue = next->second;
  Turn turn = std::move(queue.turns.front());
  queue.turns.pop_front();
  --num_tasks_;
  now_s_ = std::max(now_s_, queue.used_s);
  queue.used_s += expected_s;
  queue.since = ++num_turns_;
  if (queue.turns.empty()) {
    Keep(turn.client, queue.used_s);
    queues_.erase(next);
  }
  return turn;
}

void FairQueue::Keep(const std::string& client, double used_s) noexcept {
  if (absent_.size() >= kMaxAbsent) {
    std::erase_if(absent_, [&](const auto& absent) { return absent.second <= now_s_; });
  }
  if (absent_.size() >= kMaxAbsent) absent_.clear();
  try {
    absent_[client] = used_s;
  } catch (const std::bad_alloc&) {
    // It starts anew when it comes back.
  }
}

void FairQueue::Correct(const std::string& client, double seconds) {
  if (const auto queue = queues_.find(client); queue != queues_.end()) {
    queue->second.used_s += seconds;
  } else if (const auto absent = absent_.find(client); absent != absent_.end()) {
    absent->second += seconds;
  }
}

FairQueue::Queues::const_iterator FairQueue::Longest() const {
  return std::ranges::max_element(queues_, [](const auto& a, const auto& b) {
    return a.second.turns.size() < b.second.turns.size();
  });
}

bool FairQueue::HasToSpareFor(const std::string& client) const {
  const auto own = queues_.find(client);
  const std::size_t num_own = own == queues_.end() ? 0 : own->second.turns.size();
  const auto longest = Longest();
  return longest != queues_.end() && longest->second.turns.size() >= num_own + 2;
}

FairQueue::Task FairQueue::TakeLastFor(const std::string& client) noexcept {
  if (!HasToSpareFor(client)) return nullptr;
  std::deque<Turn>& longest = queues_.find(Longest()->first)->second.turns;
  Task last = std::move(longest.back().task);
  longest.pop_back();  // at least one is left: it had two more than another
  --num_tasks_;
  return last;
}

}  // namespace scanloc::server
