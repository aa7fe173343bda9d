#pragma once

#include <cstdint>
#include <functional>
#include <mutex>

namespace scanloc::server {

/// Tells the memory that clients make the process hold from what maps take: whatever it holds
/// beyond what it held when it was last quiet. Thread-safe.
class MemoryBound {
 public:
  /// Clients may make it hold so much.
  explicit MemoryBound(std::int64_t max_bytes);

  /// While it lives a map is loaded, for which memory is needed as for a file of so many bytes.
  class Loading {
   public:
    Loading(MemoryBound& bound, std::int64_t file_bytes);
    ~Loading();
    Loading(const Loading&) = delete;
    Loading& operator=(const Loading&) = delete;

   private:
    MemoryBound& bound_;
    const std::int64_t allowance_bytes_;
  };

  struct State {
    bool is_over = false;    ///< more than clients may have it hold
    bool has_slack = false;  ///< some that the requests at hand do not account for
    bool is_odd = false;     ///< so much of it that something is wrong
  };

  /// work_bytes: of what the process holds, what is the workers' own or kept of maps.
  /// at_hand_bytes: what the requests at hand may account for; asked only where it matters.
  [[nodiscard]] State Look(std::int64_t work_bytes,
                           const std::function<std::int64_t()>& at_hand_bytes);

  /// What is held now is what it takes.
  void Accept();

 private:
  const std::int64_t max_bytes_;
  std::mutex mutex_;
  std::int64_t max_virtual_bytes_;
  std::int64_t base_bytes_;
  std::int64_t loading_bytes_ = 0;  // allowed beyond the base
  int num_loading_ = 0;
};

}  // namespace scanloc::server
