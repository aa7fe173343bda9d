#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"

namespace scanloc::server {

/// Tasks of clients that share the time of the workers: next is the client that has had least of
/// it, so that one whose tasks last long does not slow one whose tasks are short. A client that
/// comes anew, or comes back, starts where those stand whose turn it is: nobody saves up time by
/// staying away. Start-time fair queueing (Goyal, Vin, Cheng 1996) with equal weights; a task is
/// charged what is expected of it when it starts, and what it took when it is done. Not
/// thread-safe.
class FairQueue {
 public:
  using Task = absl::AnyInvocable<void(const absl::StatusOr<int>& worker)>;

  struct Turn {
    std::string client;
    Task task;
  };

  /// Tasks of one client keep their order. Where memory is short it throws std::bad_alloc, and the
  /// turn and the line are as they were.
  void Add(Turn&& turn);

  /// The first task of the client whose turn it is; of those alike, who has waited longest. The
  /// client is charged `expected_s` at once. Requires one that waits.
  [[nodiscard]] Turn TakeNext(double expected_s) noexcept;

  /// Charges what a task took beyond (or short of) what was expected of it.
  void Correct(const std::string& client, double seconds);

  /// The last task of the client that has most, if it has at least two more than this one; else
  /// null.
  [[nodiscard]] Task TakeLastFor(const std::string& client) noexcept;
  [[nodiscard]] bool HasToSpareFor(const std::string& client) const;

  [[nodiscard]] int size() const { return num_tasks_; }

  /// Clients without a task here whose time is still known.
  [[nodiscard]] std::size_t num_remembered() const { return absent_.size(); }

 private:
  struct Queue {
    double used_s = 0.0;
    std::uint64_t since = 0;  // when it last got in line behind those alike
    std::deque<Turn>
        turns;  // never empty; each has the client's name, so that taking it needs none
  };
  using Queues = std::map<std::string, Queue>;

  [[nodiscard]] Queues::const_iterator Longest() const;
  void Keep(const std::string& client, double used_s) noexcept;

  Queues queues_;                                   // of clients that have tasks here
  std::unordered_map<std::string, double> absent_;  // what others have used [s]
  double now_s_ = 0.0;                              // what the client had used whose turn was last
  std::uint64_t num_turns_ = 0;
  int num_tasks_ = 0;
};

}  // namespace scanloc::server
