#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "front/memory_bound.hpp"
#include "front/self_check.hpp"

namespace scanloc::server {

/// Looks after the front: asks it as a client would, and looks at the memory that it takes. One
/// that does not answer, or takes too much, is to be made anew. On a thread of its own.
class Watchdog {
 public:
  struct Ward {
    /// A question on its way to the front.
    std::function<std::unique_ptr<SelfCheck>()> ask;
    /// As MemoryBound::Look has them [bytes].
    std::function<std::int64_t()> work_bytes;
    std::function<std::int64_t()> at_hand_bytes;
    /// Throws the front away and makes another one; why, as one word: deaf, memory.
    std::function<void(const std::string& why)> make_anew;
    /// Told whether the front has answered.
    std::function<void(bool is_answered)> asked;
  };

  Watchdog(Ward ward, MemoryBound& memory);

  /// From now on only memory is looked at: a front that drains answers nobody new.
  void StopAsking() { is_asking_ = false; }

 private:
  using Clock = std::chrono::steady_clock;

  void Run(const std::stop_token& stop);
  void LookAtMemory();
  void Ask();
  void TakeOutcome(bool is_answered);
  void MakeAnew(const std::string& why);

  const Ward ward_;
  MemoryBound& memory_;
  std::atomic<bool> is_asking_ = true;

  // Of the thread.
  std::unique_ptr<SelfCheck> question_;
  Clock::time_point asked_;
  Clock::time_point next_question_;
  Clock::time_point well_;  // when it last was, or was made
  int num_unanswered_ = 0;  // since then
  std::chrono::nanoseconds max_deafness_;
  Clock::time_point odd_since_;
  bool is_odd_ = false;
  Clock::time_point last_trim_;
  Clock::time_point settled_;
  std::jthread thread_;
};

}  // namespace scanloc::server
