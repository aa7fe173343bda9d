#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"

namespace scanloc::server {

class IdleCalls;

/// One that waits for its client: its request is on its way, or it is a stream between two
/// requests.
class IdleCall {
 public:
  virtual ~IdleCall() = default;

 private:
  friend class IdleCalls;
  struct Item {
    std::shared_ptr<IdleCall> call;
    std::string client;
    std::chrono::steady_clock::time_point entered;
  };

  /// It waits no more, for this reason; whoever calls Leave for it from then on is told so. From
  /// any thread, without a lock held.
  virtual void OnEvicted(const absl::Status& why) = 0;

  // Guarded by IdleCalls.
  bool is_in_ = false;
  bool is_settled_ = false;
  std::list<Item>::iterator item_;
};

/// Calls that wait for their clients: each at most so long (an idle timeout), and at most so many
/// at once. What waits is in its hands; who gets it out, by Leave or by being its OnEvicted, goes
/// on with it alone. Thread-safe.
class IdleCalls {
 public:
  /// A request that is there so soon counts for nothing while it is received.
  static constexpr std::chrono::milliseconds kReceivedAtOnce{250};

  struct Options {
    int max_idle = 0;
    /// What waits less long than this is not counted: most requests are there at once, and need not
    /// suffer from those that are not.
    std::chrono::duration<double> grace{};
    std::chrono::duration<double> timeout{};
    std::string full;     ///< what one too many is told
    std::string expired;  ///< what one is told that has waited too long
  };

  explicit IdleCalls(Options options);

  /// From now on the call waits. Calls `start`, if given, before anybody can evict it; `start` may
  /// use neither this nor anything that waits for it. Once it is counted and is one too many, it is
  /// evicted with ResourceExhausted and a RetryInfo, or refused if that is at once; but if a client
  /// has at least two more than this one, that client's oldest is evicted instead.
  [[nodiscard]] absl::Status Enter(const std::shared_ptr<IdleCall>& call, const std::string& client,
                                   const std::function<void()>& start = nullptr);

  /// The call waits no more. False if it did not: it was evicted, or never entered. Or if
  /// `only_if`, called if it waits, says so.
  [[nodiscard]] bool Leave(IdleCall& call, const std::function<bool()>& only_if = nullptr);

  /// From now on nobody waits longer than the grace; who does is evicted with Unavailable.
  void Drain(std::chrono::duration<double> grace);

  [[nodiscard]] int num_idle() const;

 private:
  using Clock = std::chrono::steady_clock;

  using Items = std::list<IdleCall::Item>;
  using Evicted = std::list<std::pair<std::shared_ptr<IdleCall>, absl::Status>>;

  void Run(const std::stop_token& stop);
  [[nodiscard]] std::chrono::duration<double> LookInterval() const;
  /// All with mutex_ held. Evicted are to be told, without it, of it.
  [[nodiscard]] std::shared_ptr<IdleCall> TakeOut(IdleCall& call);
  [[nodiscard]] absl::Status MakeRoomFor(const std::string& client, Evicted& evicted);
  void Settle(IdleCall& call);
  void SettleWhoHasWaited(Evicted& evicted);
  void TakeExpired(Items& items, Evicted& evicted);

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  Items fresh_;  // within the grace; who came first is first, here and below
  Items settled_;
  std::map<std::string, int> num_by_client_;  // of settled_
  std::chrono::duration<double> timeout_;
  bool is_draining_ = false;
  std::jthread sweeper_;  // last: joined first
};

}  // namespace scanloc::server
