#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace scanloc::server {

/// A bound on the bytes that are held at once. Thread-safe.
class ByteBudget {
 public:
  explicit ByteBudget(std::int64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Bytes taken from the budget, given back with it.
  class Share {
   public:
    Share() = default;
    Share(ByteBudget& budget, std::int64_t num_bytes) : budget_(&budget), num_bytes_(num_bytes) {
      budget.used_bytes_ += num_bytes;
    }
    ~Share() {
      if (budget_ != nullptr) budget_->used_bytes_ -= num_bytes_;
    }
    Share(Share&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)), num_bytes_(other.num_bytes_) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(num_bytes_, other.num_bytes_);
      return *this;
    }

   private:
    ByteBudget* budget_ = nullptr;
    std::int64_t num_bytes_ = 0;
  };

  /// More is taken than there is.
  [[nodiscard]] bool is_overdrawn() const { return used_bytes_ > max_bytes_; }

 private:
  const std::int64_t max_bytes_;
  std::atomic<std::int64_t> used_bytes_ = 0;
};

}  // namespace scanloc::server
