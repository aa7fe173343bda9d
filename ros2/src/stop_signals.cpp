#include "stop_signals.hpp"

#include <pthread.h>
#include <signal.h>

#include <cstdlib>
#include <utility>

namespace scanloc::ros2 {
namespace {

sigset_t Watched() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

}  // namespace

StopSignals::StopSignals() {
  const sigset_t signals = Watched();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

StopSignals::~StopSignals() {
  if (!thread_.joinable()) return;
  ends_ = true;
  pthread_kill(thread_.native_handle(), SIGINT);
  thread_.join();
}

void StopSignals::Watch(std::function<void()> on_stop) {
  thread_ = std::thread([this, on_stop = std::move(on_stop)] {
    const sigset_t signals = Watched();
    int signal = 0;
    while (sigwait(&signals, &signal) != 0 || !ends_) {
      if (came_.exchange(true)) std::_Exit(128 + signal);
      on_stop();
    }
  });
}

}  // namespace scanloc::ros2
