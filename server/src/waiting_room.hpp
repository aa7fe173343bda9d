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

class WaitingRoom;

/// What waits for its peer: a call whose request is on its way, a stream between two requests.
class Waiter {
 public:
  virtual ~Waiter() = default;

 private:
  friend class WaitingRoom;
  struct Item {
    std::shared_ptr<Waiter> waiter;
    std::string client;
    std::chrono::steady_clock::time_point entered;
  };

  /// It was put out of the room, for this reason; whoever calls Leave for it from then on is told
  /// so. From any thread, without a lock held.
  virtual void OnPutOut(const absl::Status& why) = 0;

  // Guarded by the room.
  bool is_in_ = false;
  bool is_settled_ = false;
  std::list<Item>::iterator item_;
};

/// Holds those that wait for their peers: each at most so long, and at most so many at once. Who
/// waits is in the hands of the room; who gets it out, by Leave or by being its OnPutOut, goes on
/// with it alone. Thread-safe.
class WaitingRoom {
 public:
  struct Options {
    int max_waiters = 0;
    /// Who waits less long than this is not counted: most requests are there at once, and need not
    /// suffer from those that are not.
    std::chrono::duration<double> grace{};
    std::chrono::duration<double> timeout{};
    std::string full;     ///< what a waiter is told for whom there is no room
    std::string expired;  ///< what a waiter is told that has waited too long
  };

  explicit WaitingRoom(Options options);
  ~WaitingRoom();
  WaitingRoom(const WaitingRoom&) = delete;
  WaitingRoom& operator=(const WaitingRoom&) = delete;

  /// Lets one in, and calls `start`, if given, before anybody can put it out again; `start` may use
  /// neither the room nor anything that waits for it. Once it is counted and the room is full, it
  /// is put out with ResourceExhausted and a RetryInfo, or refused if that is at once; but if a
  /// client has at least two more in it than this one, that client's oldest is put out instead.
  [[nodiscard]] absl::Status Enter(const std::shared_ptr<Waiter>& waiter, const std::string& client,
                                   const std::function<void()>& start = nullptr);

  /// False if it is not in: it was put out, or never let in. Or if `only_if`, called if it is in,
  /// says so.
  [[nodiscard]] bool Leave(Waiter& waiter, const std::function<bool()>& only_if = nullptr);

  /// From now on nobody waits longer than the grace; who does is put out with Unavailable.
  void Drain(std::chrono::duration<double> grace);

  [[nodiscard]] int num_waiters() const;

 private:
  using Clock = std::chrono::steady_clock;

  using Items = std::list<Waiter::Item>;
  using Leavers = std::list<std::pair<std::shared_ptr<Waiter>, absl::Status>>;

  void Run();
  [[nodiscard]] std::chrono::duration<double> LookInterval() const;
  /// All with mutex_ held. Leavers are to be told, without it, that they were put out.
  [[nodiscard]] std::shared_ptr<Waiter> TakeOut(Waiter& waiter);
  [[nodiscard]] absl::Status MakeRoomFor(const std::string& client, Leavers& leavers);
  void Settle(Waiter& waiter);
  void SettleWhoHasWaited(Leavers& leavers);
  void TakeExpired(Items& items, Leavers& leavers);

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  Items fresh_;  // within the grace; who came first is first, here and below
  Items settled_;
  std::map<std::string, int> num_by_client_;  // of settled_
  std::chrono::duration<double> timeout_;
  bool is_draining_ = false;
  bool is_stopping_ = false;
  std::thread sweeper_;
};

}  // namespace scanloc::server
