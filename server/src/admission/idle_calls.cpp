#include "admission/idle_calls.hpp"

#include <algorithm>
#include <cstddef>

#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

constexpr double kRetryWhenFull_s = 1.0;
constexpr std::size_t kMaxFresh = 4096;
/// Waiters are looked at this many times within the time that they have.
constexpr int kLooksPerTimeout = 8;
constexpr std::chrono::duration<double> kMinLookInterval(0.005);
constexpr std::chrono::duration<double> kMaxLookInterval(1.0);

}  // namespace

IdleCalls::IdleCalls(Options options)
    : options_(std::move(options)),
      timeout_(options_.timeout),
      sweeper_([this](const std::stop_token& stop) { Run(stop); }) {}

absl::Status IdleCalls::Enter(const std::shared_ptr<IdleCall>& call, const std::string& client,
                              const std::function<void()>& start) {
  Evicted evicted;
  {
    const std::lock_guard lock(mutex_);
    if (fresh_.size() >= kMaxFresh) return absl::ResourceExhaustedError(options_.full);
    const bool has_grace = options_.grace.count() > 0.0;
    if (!has_grace) {
      RETURN_IF_ERROR(MakeRoomFor(client, evicted));
    }
    call->item_ =
        fresh_.insert(fresh_.end(), {.call = call, .client = client, .entered = Clock::now()});
    call->is_in_ = true;
    call->is_settled_ = false;
    if (!has_grace) Settle(*call);
    if (start) start();
  }
  for (const auto& [idle, why] : evicted) idle->OnEvicted(why);
  return absl::OkStatus();
}

bool IdleCalls::Leave(IdleCall& call, const std::function<bool()>& only_if) {
  std::shared_ptr<IdleCall> held;  // let go of without the lock
  const std::lock_guard lock(mutex_);
  if (!call.is_in_ || (only_if && !only_if())) return false;
  held = TakeOut(call);
  return true;
}

std::shared_ptr<IdleCall> IdleCalls::TakeOut(IdleCall& call) {
  call.is_in_ = false;
  std::shared_ptr<IdleCall> held = std::move(call.item_->call);
  if (call.is_settled_) {
    const auto count = num_by_client_.find(call.item_->client);
    if (--count->second == 0) num_by_client_.erase(count);
  }
  (call.is_settled_ ? settled_ : fresh_).erase(call.item_);
  return held;
}

void IdleCalls::Settle(IdleCall& call) {
  ++num_by_client_[call.item_->client];
  settled_.splice(settled_.end(), fresh_, call.item_);
  call.is_settled_ = true;
}

absl::Status IdleCalls::MakeRoomFor(const std::string& client, Evicted& evicted) {
  if (static_cast<int>(settled_.size()) < options_.max_idle) return absl::OkStatus();
  absl::Status full =
      proto::WithRetryAfter(absl::ResourceExhaustedError(options_.full), kRetryWhenFull_s);
  const auto own = num_by_client_.find(client);
  const int num_own = own == num_by_client_.end() ? 0 : own->second;
  const auto most = std::ranges::max_element(
      num_by_client_, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == num_by_client_.end() || most->second < num_own + 2) return full;
  const auto oldest = std::ranges::find(settled_, most->first, &IdleCall::Item::client);
  evicted.emplace_back(TakeOut(*oldest->call), full);
  return absl::OkStatus();
}

void IdleCalls::SettleWhoHasWaited(Evicted& evicted) {
  const auto now = Clock::now();
  while (!fresh_.empty() && now - fresh_.front().entered >= options_.grace) {
    IdleCall& call = *fresh_.front().call;
    if (auto status = MakeRoomFor(fresh_.front().client, evicted); status.ok()) {
      Settle(call);
    } else {
      evicted.emplace_back(TakeOut(call), status);
    }
  }
}

void IdleCalls::TakeExpired(Items& items, Evicted& evicted) {
  const auto now = Clock::now();
  while (!items.empty() && now - items.front().entered >= timeout_) {
    evicted.emplace_back(TakeOut(*items.front().call),
                         is_draining_
                             ? proto::WithReason(v1::ERROR_REASON_DRAINING,
                                                 absl::UnavailableError("the server is draining"))
                             : absl::DeadlineExceededError(options_.expired));
  }
}

void IdleCalls::Drain(std::chrono::duration<double> grace) {
  {
    const std::lock_guard lock(mutex_);
    is_draining_ = true;
    timeout_ = std::min(timeout_, grace);
  }
  wake_.notify_all();
}

int IdleCalls::num_idle() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(fresh_.size() + settled_.size());
}

std::chrono::duration<double> IdleCalls::LookInterval() const {
  std::chrono::duration<double> interval = timeout_ / kLooksPerTimeout;
  if (options_.grace.count() > 0.0) interval = std::min(interval, options_.grace / 2);
  return std::clamp(interval, kMinLookInterval, kMaxLookInterval);
}

void IdleCalls::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    Evicted evicted;
    TakeExpired(settled_, evicted);
    TakeExpired(fresh_, evicted);
    SettleWhoHasWaited(evicted);
    if (evicted.empty()) {
      wake_.wait_for(lock, stop, LookInterval(),
                     [&, before = timeout_] { return timeout_ != before; });
      continue;
    }
    lock.unlock();
    for (const auto& [idle, why] : evicted) idle->OnEvicted(why);
    evicted.clear();
    lock.lock();
  }
}

}  // namespace scanloc::server
