#include "scanloc/server/fair_line.hpp"

#include <algorithm>
#include <cstddef>

namespace scanloc::server {
namespace {

/// Beyond so many, the clients that have no task here start anew when they come back.
constexpr std::size_t kMaxAbsent = 4096;

}  // namespace

void FairLine::Add(const std::string& client, Task task) {
  const auto [queue, is_new] = queues_.try_emplace(client);
  if (is_new) {
    const auto absent = absent_.extract(client);
    queue->second.used_s = absent ? std::max(absent.mapped(), now_s_) : now_s_;
    queue->second.since = ++num_turns_;
  }
  queue->second.tasks.push_back(std::move(task));
  ++num_tasks_;
}

FairLine::Turn FairLine::TakeNext(double expected_s) {
  const auto next =
      std::min_element(queues_.begin(), queues_.end(), [](const auto& a, const auto& b) {
        return std::pair(a.second.used_s, a.second.since) <
               std::pair(b.second.used_s, b.second.since);
      });
  Queue& queue = next->second;
  Turn turn{next->first, std::move(queue.tasks.front())};
  queue.tasks.pop_front();
  --num_tasks_;
  now_s_ = std::max(now_s_, queue.used_s);
  queue.used_s += expected_s;
  queue.since = ++num_turns_;
  if (queue.tasks.empty()) {
    Keep(turn.client, queue.used_s);
    queues_.erase(next);
  }
  return turn;
}

void FairLine::Keep(const std::string& client, double used_s) {
  if (absent_.size() >= kMaxAbsent) {
    std::erase_if(absent_, [&](const auto& absent) { return absent.second <= now_s_; });
  }
  if (absent_.size() >= kMaxAbsent) absent_.clear();
  absent_[client] = used_s;
}

void FairLine::Correct(const std::string& client, double seconds) {
  if (const auto queue = queues_.find(client); queue != queues_.end()) {
    queue->second.used_s += seconds;
  } else if (const auto absent = absent_.find(client); absent != absent_.end()) {
    absent->second += seconds;
  }
}

FairLine::Queues::const_iterator FairLine::Longest() const {
  return std::max_element(queues_.begin(), queues_.end(), [](const auto& a, const auto& b) {
    return a.second.tasks.size() < b.second.tasks.size();
  });
}

bool FairLine::HasToSpareFor(const std::string& client) const {
  const auto own = queues_.find(client);
  const std::size_t num_own = own == queues_.end() ? 0 : own->second.tasks.size();
  const auto longest = Longest();
  return longest != queues_.end() && longest->second.tasks.size() >= num_own + 2;
}

FairLine::Task FairLine::TakeLastFor(const std::string& client) {
  if (!HasToSpareFor(client)) return nullptr;
  std::deque<Task>& longest = queues_.find(Longest()->first)->second.tasks;
  Task last = std::move(longest.back());
  longest.pop_back();  // at least one is left: it had two more than another
  --num_tasks_;
  return last;
}

}  // namespace scanloc::server
