#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace scanloc::ros2 {

/// Waits for SIGTERM and SIGINT on a thread of its own. Made before any other thread, so that none
/// of them gets these signals. The first one makes came() true; a second one ends the process.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();

  /// Calls on_stop when a signal comes, from that thread. Once.
  void Watch(std::function<void()> on_stop);
  [[nodiscard]] bool came() const { return came_; }

 private:
  std::atomic<bool> came_ = false;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace scanloc::ros2
