#include "waiting_room.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

constexpr double kRetry_s = 1.0;
constexpr std::size_t kMaxFresh = 4096;
/// Waiters are looked at this many times within the time that they have.
constexpr int kLooksPerTimeout = 8;
constexpr std::chrono::duration<double> kMinLookInterval(0.005);
constexpr std::chrono::duration<double> kMaxLookInterval(1.0);

}  // namespace

WaitingRoom::WaitingRoom(Options options)
    : options_(std::move(options)), timeout_(options_.timeout), sweeper_([this] { Run(); }) {}

WaitingRoom::~WaitingRoom() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  wake_.notify_all();
  sweeper_.join();
}

absl::Status WaitingRoom::Enter(const std::shared_ptr<Waiter>& waiter, const std::string& client,
                                const std::function<void()>& start) {
  Leavers leavers;
  {
    const std::lock_guard lock(mutex_);
    if (fresh_.size() >= kMaxFresh) return absl::ResourceExhaustedError(options_.full);
    const bool has_grace = options_.grace.count() > 0.0;
    if (!has_grace) {
      if (auto status = MakeRoomFor(client, leavers); !status.ok()) return status;
    }
    waiter->item_ =
        fresh_.insert(fresh_.end(), {.waiter = waiter, .client = client, .entered = Clock::now()});
    waiter->is_in_ = true;
    waiter->is_settled_ = false;
    if (!has_grace) Settle(*waiter);
    if (start) start();
  }
  for (const auto& [leaver, why] : leavers) leaver->OnPutOut(why);
  return absl::OkStatus();
}

bool WaitingRoom::Leave(Waiter& waiter, const std::function<bool()>& only_if) {
  std::shared_ptr<Waiter> held;  // let go of without the lock
  const std::lock_guard lock(mutex_);
  if (!waiter.is_in_ || (only_if && !only_if())) return false;
  held = TakeOut(waiter);
  return true;
}

std::shared_ptr<Waiter> WaitingRoom::TakeOut(Waiter& waiter) {
  waiter.is_in_ = false;
  std::shared_ptr<Waiter> held = std::move(waiter.item_->waiter);
  if (waiter.is_settled_) {
    const auto count = num_by_client_.find(waiter.item_->client);
    if (--count->second == 0) num_by_client_.erase(count);
  }
  (waiter.is_settled_ ? settled_ : fresh_).erase(waiter.item_);
  return held;
}

void WaitingRoom::Settle(Waiter& waiter) {
  ++num_by_client_[waiter.item_->client];
  settled_.splice(settled_.end(), fresh_, waiter.item_);
  waiter.is_settled_ = true;
}

absl::Status WaitingRoom::MakeRoomFor(const std::string& client, Leavers& leavers) {
  if (static_cast<int>(settled_.size()) < options_.max_waiters) return absl::OkStatus();
  absl::Status full = proto::WithRetryAfter(absl::ResourceExhaustedError(options_.full), kRetry_s);
  const auto own = num_by_client_.find(client);
  const int num_own = own == num_by_client_.end() ? 0 : own->second;
  const auto most =
      std::max_element(num_by_client_.begin(), num_by_client_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == num_by_client_.end() || most->second < num_own + 2) return full;
  const auto oldest = std::find_if(settled_.begin(), settled_.end(), [&](const Waiter::Item& item) {
    return item.client == most->first;
  });
  leavers.emplace_back(TakeOut(*oldest->waiter), full);
  return absl::OkStatus();
}

void WaitingRoom::SettleWhoHasWaited(Leavers& leavers) {
  const auto now = Clock::now();
  while (!fresh_.empty() && now - fresh_.front().entered >= options_.grace) {
    Waiter& waiter = *fresh_.front().waiter;
    if (auto status = MakeRoomFor(fresh_.front().client, leavers); status.ok()) {
      Settle(waiter);
    } else {
      leavers.emplace_back(TakeOut(waiter), status);
    }
  }
}

void WaitingRoom::TakeExpired(Items& items, Leavers& leavers) {
  const auto now = Clock::now();
  while (!items.empty() && now - items.front().entered >= timeout_) {
    leavers.emplace_back(TakeOut(*items.front().waiter),
                         is_draining_
                             ? proto::WithReason(v1::ERROR_REASON_DRAINING,
                                                 absl::UnavailableError("the server is draining"))
                             : absl::DeadlineExceededError(options_.expired));
  }
}

void WaitingRoom::Drain(std::chrono::duration<double> grace) {
  {
    const std::lock_guard lock(mutex_);
    is_draining_ = true;
    timeout_ = std::min(timeout_, grace);
  }
  wake_.notify_all();
}

int WaitingRoom::num_waiters() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(fresh_.size() + settled_.size());
}

std::chrono::duration<double> WaitingRoom::LookInterval() const {
  std::chrono::duration<double> interval = timeout_ / kLooksPerTimeout;
  if (options_.grace.count() > 0.0) interval = std::min(interval, options_.grace / 2);
  return std::clamp(interval, kMinLookInterval, kMaxLookInterval);
}

void WaitingRoom::Run() {
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    Leavers leavers;
    TakeExpired(settled_, leavers);
    TakeExpired(fresh_, leavers);
    SettleWhoHasWaited(leavers);
    if (leavers.empty()) {
      wake_.wait_for(lock, LookInterval());
      continue;
    }
    lock.unlock();
    for (const auto& [leaver, why] : leavers) leaver->OnPutOut(why);
    leavers.clear();
    lock.lock();
  }
}

}  // namespace scanloc::server
