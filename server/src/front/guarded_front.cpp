#include "front/guarded_front.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "front/credentials.hpp"
#include "front/memory.hpp"
#include "ops/service_manager.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

/// A scan is held as the bytes received, as a message, as points and, while it is described, as
/// voxels.
constexpr std::int64_t kCopiesOfReceived = 4;

}  // namespace

absl::StatusOr<std::unique_ptr<GuardedFront>> GuardedFront::Open(Options options,
                                                                 const CallWaits& waits,
                                                                 MemoryBound& memory) {
  ASSIGN_OR_RETURN(auto identity, MakeOwnIdentity());
  ASSIGN_OR_RETURN(auto tls, ProbeTls::Make(identity));
  ASSIGN_OR_RETURN(auto listener,
                   Listener::Open(options.listen, MaxConnections(options.max_memory_bytes)));
  auto guarded = std::unique_ptr<GuardedFront>(new GuardedFront(
      std::move(options), waits, memory, std::move(listener), identity.cert, std::move(tls)));
  RETURN_IF_ERROR(guarded->MakeFront());
  GuardedFront& own = *guarded;
  own.watchdog_ = std::make_unique<Watchdog>(
      Watchdog::Ward{.ask =
                         [&own] {
                           return std::make_unique<SelfCheck>(
                               own.listener_->own_address(),
                               own.options_.tls == nullptr ? nullptr : own.tls_.get());
                         },
                     .work_bytes = own.options_.work_bytes,
                     // They cannot be more than copies of what was sent; what is, is gRPC's own.
                     .at_hand_bytes =
                         [&own] {
                           return std::min(
                                      own.options_.at_hand_bytes(),
                                      kCopiesOfReceived * own.listener_->num_bytes_received()) +
                                  kBytesPerConnection * own.listener_->num_connections();
                         },
                     .make_anew = [&own](const std::string& why) { own.MakeAnew(why); },
                     .asked =
                         [&own](bool is_answered) {
                           own.options_.asked_itself(is_answered);
                           if (is_answered && IsServiceManagerWatching())
                             TellServiceManager("WATCHDOG=1");
                         }},
      memory);
  return guarded;
}

GuardedFront::GuardedFront(Options options, const CallWaits& waits, MemoryBound& memory,
                           std::unique_ptr<Listener> listener, std::string own_cert,
                           std::unique_ptr<ProbeTls> tls)
    : options_(std::move(options)),
      waits_(waits),
      memory_(memory),
      listener_(std::move(listener)),
      own_cert_(std::move(own_cert)),
      tls_(std::move(tls)) {}

absl::Status GuardedFront::MakeFront() {
  ASSIGN_OR_RETURN(front_, Front::Open(*listener_, waits_,
                                       {.services = options_.services,
                                        .credentials = MakeCredentials(options_.tls, own_cert_),
                                        .max_message_bytes = options_.max_message_bytes,
                                        .max_memory_bytes = options_.max_memory_bytes}));
  return absl::OkStatus();
}

void GuardedFront::MakeAnew(const std::string& why) {
  const std::lock_guard lock(mutex_);
  options_.made_anew(why);
  if (is_draining_) {
    if (front_ != nullptr) front_->HangUp();
    return;
  }
  spdlog::error("all connections are ended and the server's front is made anew: {}",
                why == "memory" ? "clients made it hold more memory than they may"
                                : "it did not answer itself");
  front_.reset();
  ReturnFreedMemory();
  memory_.Accept();
  if (auto status = MakeFront(); !status.ok()) spdlog::error("{}", status.ToString());
}

void GuardedFront::Shutdown(std::chrono::nanoseconds patience) {
  watchdog_->StopAsking();
  {
    const std::lock_guard lock(mutex_);
    is_draining_ = true;
  }
  if (front_ != nullptr) front_->Shutdown(patience);
}

}  // namespace scanloc::server
