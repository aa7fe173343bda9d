#include "lifecycle.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>

#include "ops/service_manager.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/server/build_info.hpp"

namespace scanloc::server {
namespace {

/// Beyond the drain time, for cancelled queries to notice.
constexpr std::chrono::seconds kGrace(2);

sigset_t WatchedSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  return signals;
}

/// What the main thread waits for.
struct Event {
  enum class Kind : std::uint8_t { kSignal, kLoaded, kDrained };
  Kind kind = Kind::kSignal;
  int signal = 0;
  absl::Status loaded;
};

class Mailbox {
 public:
  void Post(Event event) {
    {
      const std::lock_guard lock(mutex_);
      events_.push_back(std::move(event));
    }
    has_event_.notify_one();
  }

  [[nodiscard]] Event Wait() {
    std::unique_lock lock(mutex_);
    has_event_.wait(lock, [this] { return !events_.empty(); });
    return Pop();
  }

  /// None if the time came first.
  [[nodiscard]] std::optional<Event> WaitUntil(std::chrono::steady_clock::time_point time) {
    std::unique_lock lock(mutex_);
    if (!has_event_.wait_until(lock, time, [this] { return !events_.empty(); })) return {};
    return Pop();
  }

 private:
  Event Pop() {
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
  }

  std::mutex mutex_;
  std::condition_variable has_event_;
  std::deque<Event> events_;
};

/// Posts every watched signal that the process gets while it lives.
class SignalWatcher {
 public:
  explicit SignalWatcher(Mailbox& mailbox) : thread_([this, &mailbox] { Run(mailbox); }) {}

  ~SignalWatcher() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    pthread_kill(thread_.native_handle(), SIGINT);
    thread_.join();
  }

 private:
  void Run(Mailbox& mailbox) {
    const sigset_t signals = WatchedSignals();
    while (true) {
      int signal = 0;
      if (sigwait(&signals, &signal) != 0) continue;
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      mailbox.Post({.kind = Event::Kind::kSignal, .signal = signal, .loaded = {}});
    }
  }

  std::mutex mutex_;
  bool ending_ = false;
  std::thread thread_;
};

/// With the monotonic time, by which the service manager tells this reload from earlier ones.
std::string ReloadingState() {
  const auto now = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::steady_clock::now().time_since_epoch());
  return "RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now.count());
}

[[noreturn]] void ExitAtOnce(int status, const char* why) {
  spdlog::warn("ending at once: {}", why);
  std::_Exit(status);
}

/// Waits until the server is drained and nothing loads any more.
void AwaitEnd(Mailbox& mailbox, bool loading, std::chrono::steady_clock::time_point latest) {
  bool drained = false;
  while (!drained || loading) {
    const std::optional<Event> event = mailbox.WaitUntil(latest);
    if (!event) ExitAtOnce(EXIT_SUCCESS, "something still runs after the drain time");
    switch (event->kind) {
      case Event::Kind::kSignal:
        if (event->signal == SIGHUP) break;  // too late to load anything
        ExitAtOnce(128 + event->signal, "signalled a second time");
      case Event::Kind::kLoaded:
        loading = false;
        break;
      case Event::Kind::kDrained:
        drained = true;
        break;
    }
  }
}

}  // namespace

void BlockStopSignals() {
  const sigset_t signals = WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

int RunUntilStopped(Server& server, std::chrono::duration<double> drain,
                    const ThreadStarter& start_thread) {
  Mailbox mailbox;
  const SignalWatcher watcher(mailbox);
  const auto post_loaded = [&](absl::Status status) {
    mailbox.Post({.kind = Event::Kind::kLoaded, .signal = 0, .loaded = std::move(status)});
  };
  std::thread loader = start_thread([&] { post_loaded(server.LoadMaps()); });

  bool loading = true;
  bool ready = false;
  bool reload_due = false;
  absl::Status loaded;
  while (loaded.ok()) {
    const Event event = mailbox.Wait();
    if (event.kind == Event::Kind::kSignal && event.signal != SIGHUP) {
      spdlog::info("stopping at signal {}, draining for at most {} s", event.signal, drain.count());
      break;
    }
    if (event.kind == Event::Kind::kSignal) {
      reload_due = true;  // signals that come while maps load ask for one more round together
    } else {
      loading = false;
      loaded = event.loaded;
      if (!loaded.ok()) {
        std::cerr << "scanlocd: " << Printable(std::string(loaded.message())) << '\n';
      } else if (!std::exchange(ready, true)) {
        spdlog::info("ready on {}: scanlocd {}, built by {}", server.address(), BuildVersion(),
                     BuildCompiler());
        std::cout << "scanlocd ready on " << server.address() << std::endl;
      }
      if (loaded.ok()) TellServiceManager("READY=1");
    }
    if (reload_due && !loading && loaded.ok()) {
      reload_due = false;
      if (loader.joinable()) loader.join();
      try {
        loader = start_thread([&] {
          server.ReloadMaps();
          post_loaded(absl::OkStatus());
        });
        loading = true;
        TellServiceManager(ReloadingState());
      } catch (const std::system_error& error) {
        spdlog::error("maps not reloaded: no thread for it: {}", error.what());
      }
    }
  }

  TellServiceManager("STOPPING=1");
  const auto latest =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(drain + kGrace);
  const auto drain_now = [&] {
    server.Shutdown();
    mailbox.Post({.kind = Event::Kind::kDrained, .signal = 0, .loaded = {}});
  };
  std::thread drainer;
  try {
    drainer = start_thread(drain_now);
  } catch (const std::system_error&) {
    drain_now();  // a second signal then has to wait
  }
  AwaitEnd(mailbox, loading, latest);
  if (loader.joinable()) loader.join();
  if (drainer.joinable()) drainer.join();
  return loaded.ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace scanloc::server
