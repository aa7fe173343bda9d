#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

namespace scanloc::server {

/// A bound on the bytes that clients have the server hold at once, in shares: one client gets at
/// most half, and once three quarters are taken only who has less than an equal part of them gets
/// more, so that neither one client nor several shut another out. Thread-safe.
class ByteBudget {
 public:
  explicit ByteBudget(std::int64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Bytes taken from the budget, given back with it.
  class Share {
   public:
    Share() = default;
    /// Takes them whether there is room or not: they are held already.
    Share(ByteBudget& budget, const std::string& client, std::int64_t num_bytes)
        : budget_(&budget), client_(client), num_bytes_(num_bytes) {
      budget.Take(client_, num_bytes_);
    }
    ~Share() {
      if (budget_ != nullptr) budget_->GiveBack(client_, num_bytes_);
    }
    Share(Share&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)),
          client_(std::move(other.client_)),
          num_bytes_(other.num_bytes_) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(client_, other.client_);
      std::swap(num_bytes_, other.num_bytes_);
      return *this;
    }

   private:
    ByteBudget* budget_ = nullptr;
    std::string client_;
    std::int64_t num_bytes_ = 0;
  };

  /// The client holds more than it may, or all together do. A share that is the only one is always
  /// within the budget.
  [[nodiscard]] bool IsOverdrawnFor(const std::string& client) const {
    const std::lock_guard lock(mutex_);
    if (num_shares_ <= 1) return false;
    const auto found = clients_.find(client);
    const std::int64_t own = found == clients_.end() ? 0 : found->second;
    if (own > max_bytes_ / 2 || used_bytes_ > max_bytes_) return true;
    const std::int64_t open_to_all = max_bytes_ / 4 * 3;
    if (used_bytes_ <= open_to_all) return false;
    // With one place left for who comes next.
    return own > open_to_all / static_cast<std::int64_t>(clients_.size() + 1);
  }

  /// What the client holds.
  [[nodiscard]] std::int64_t BytesOf(const std::string& client) const {
    const std::lock_guard lock(mutex_);
    const auto found = clients_.find(client);
    return found == clients_.end() ? 0 : found->second;
  }

  [[nodiscard]] bool IsEmpty() const {
    const std::lock_guard lock(mutex_);
    return num_shares_ == 0;
  }

 private:
  void Take(const std::string& client, std::int64_t num_bytes) {
    const std::lock_guard lock(mutex_);
    clients_[client] += num_bytes;
    used_bytes_ += num_bytes;
    ++num_shares_;
  }

  void GiveBack(const std::string& client, std::int64_t num_bytes) {
    const std::lock_guard lock(mutex_);
    const auto own = clients_.find(client);
    own->second -= num_bytes;
    if (own->second <= 0) clients_.erase(own);
    used_bytes_ -= num_bytes;
    --num_shares_;
  }

  const std::int64_t max_bytes_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, std::int64_t> clients_;  // with bytes
  std::int64_t used_bytes_ = 0;
  std::int64_t num_shares_ = 0;
};

}  // namespace scanloc::server
