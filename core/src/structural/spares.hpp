#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <utility>

namespace scanloc {

/// A few objects that are dear to make, kept for whoever needs one next. Any number of threads.
template <typename Object>
class Spares {
 public:
  Spares() = default;
  ~Spares() {
    for (std::atomic<Object*>& slot : slots_) delete slot.load();
  }
  Spares(const Spares&) = delete;
  Spares& operator=(const Spares&) = delete;

  /// One for as long as this lives.
  class Lease {
   public:
    Lease(Spares& spares, std::unique_ptr<Object> object)
        : spares_(spares), object_(std::move(object)) {}
    ~Lease() { spares_.Give(std::move(object_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

    [[nodiscard]] Object& operator*() const { return *object_; }

   private:
    Spares& spares_;
    std::unique_ptr<Object> object_;
  };

  /// A spare one, or make()'s unique_ptr.
  template <typename Maker>
  [[nodiscard]] Lease Borrow(Maker&& make) {
    for (std::atomic<Object*>& slot : slots_) {
      if (Object* const spare = slot.exchange(nullptr))
        return {*this, std::unique_ptr<Object>(spare)};
    }
    return {*this, make()};
  }

 private:
  void Give(std::unique_ptr<Object> object) {
    for (std::atomic<Object*>& slot : slots_) {
      Object* none = nullptr;
      if (!slot.compare_exchange_strong(none, object.get())) continue;
      (void)object.release();
      return;
    }
  }

  std::array<std::atomic<Object*>, 4> slots_{};
};

}  // namespace scanloc
