#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "front/front.hpp"
#include "front/listener.hpp"
#include "front/memory_bound.hpp"
#include "front/self_check.hpp"
#include "front/tls_files.hpp"
#include "front/watchdog.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/raw_service.hpp"

namespace scanloc::server {

/// An address that is answered at, whatever clients do to what answers there: a listener, a front
/// behind it, and a watchdog that has the front made anew when it does not answer or takes too much
/// memory.
class GuardedFront {
 public:
  struct Options {
    std::string listen;
    const TlsFiles* tls = nullptr;  ///< null: no encryption
    std::vector<const RawService*> services;
    int max_message_bytes = 0;
    std::int64_t max_memory_bytes = 0;
    /// As MemoryBound::Look has them [bytes].
    std::function<std::int64_t()> work_bytes;
    std::function<std::int64_t()> at_hand_bytes;
    /// Told each time that the front is made anew, and why.
    std::function<void(const std::string& why)> made_anew;
    /// Told each time that the watchdog has asked.
    std::function<void(bool is_answered)> asked_itself;
  };

  /// Tls, services, waits and memory must outlive it. Unavailable: cannot listen there.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<GuardedFront>> Open(Options options,
                                                                          const CallWaits& waits,
                                                                          MemoryBound& memory);

  [[nodiscard]] const std::string& address() const { return listener_->address(); }

  /// Listens no more, waits as long as this for what is in flight, and cancels what is left; all of
  /// it at once if clients make it hold too much memory meanwhile.
  void Shutdown(std::chrono::nanoseconds patience);

 private:
  GuardedFront(Options options, const CallWaits& waits, MemoryBound& memory,
               std::unique_ptr<Listener> listener, std::string own_cert,
               std::unique_ptr<ProbeTls> tls);

  [[nodiscard]] absl::Status MakeFront();
  void MakeAnew(const std::string& why);

  const Options options_;
  const CallWaits waits_;
  MemoryBound& memory_;
  const std::unique_ptr<Listener> listener_;
  const std::string own_cert_;  // by which it asks itself
  const std::unique_ptr<ProbeTls> tls_;
  std::mutex mutex_;  // guards the next two, and that nothing is made anew while it drains
  std::unique_ptr<Front> front_;
  bool is_draining_ = false;
  std::unique_ptr<Watchdog> watchdog_;  // last: it uses all of the above
};

}  // namespace scanloc::server
