#include "front/memory_bound.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <limits>

#include "front/memory.hpp"

namespace scanloc::server {
namespace {

constexpr std::int64_t kMiB = 1 << 20;

/// A map's file, unpacked, with its index, and twice while it is built.
constexpr std::int64_t kMemoryPerFileByte = 16;
constexpr std::int64_t kLoadingBytes = 64 * kMiB;

/// What is not accounted for, beyond which it is worth to give back what was freed, and beyond
/// which at least something is wrong.
constexpr std::int64_t kMinSlackBytes = 8 * kMiB;
constexpr std::int64_t kMinOddBytes = 16 * kMiB;

/// What a sanitizer keeps beside what is used.
#ifdef SCANLOC_SANITIZED
constexpr std::int64_t kAllocatorFactor = 8;
#else
constexpr std::int64_t kAllocatorFactor = 1;
#endif

/// Of a limited address space a third is left for what is needed until the bound takes effect.
std::int64_t MaxVirtualBytes() {
  rlimit limit = {};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return std::numeric_limits<std::int64_t>::max();
  }
  const std::int64_t now = MeasureMemory().virtual_bytes;
  return now + (static_cast<std::int64_t>(limit.rlim_cur) - now) / 3 * 2;
}

}  // namespace

MemoryBound::MemoryBound(std::int64_t max_bytes)
    : max_bytes_(kAllocatorFactor * max_bytes),
      max_virtual_bytes_(MaxVirtualBytes()),
      base_bytes_(MeasureMemory().resident_bytes) {}

MemoryBound::Loading::Loading(MemoryBound& bound, std::int64_t file_bytes)
    : bound_(bound), allowance_bytes_(kLoadingBytes + kMemoryPerFileByte * file_bytes) {
  const std::lock_guard lock(bound_.mutex_);
  ++bound_.num_loading_;
  bound_.loading_bytes_ += allowance_bytes_;
}

MemoryBound::Loading::~Loading() {
  const std::int64_t now = MeasureMemory().resident_bytes;
  const std::lock_guard lock(bound_.mutex_);
  const std::int64_t most = bound_.base_bytes_ + bound_.loading_bytes_;
  bound_.loading_bytes_ -= allowance_bytes_;
  if (--bound_.num_loading_ > 0) return;
  bound_.base_bytes_ = std::min(now, most);
  bound_.max_virtual_bytes_ = MaxVirtualBytes();
}

MemoryBound::State MemoryBound::Look(std::int64_t work_bytes,
                                     const std::function<std::int64_t()>& at_hand_bytes) {
  const ProcessMemory now = MeasureMemory();
  State state;
  std::int64_t excess = 0;
  std::int64_t max_odd = 0;
  {
    const std::lock_guard lock(mutex_);
    base_bytes_ = std::min(base_bytes_, now.resident_bytes);
    excess = now.resident_bytes - base_bytes_ - loading_bytes_ - kAllocatorFactor * work_bytes;
    state.is_over = excess > max_bytes_ || now.virtual_bytes > max_virtual_bytes_;
    max_odd = kAllocatorFactor * std::max(kMinOddBytes, base_bytes_ / 4 * 3);
  }
  const std::int64_t max_slack = kAllocatorFactor * kMinSlackBytes;
  if (excess <= max_slack) return state;
  const std::int64_t unaccounted = excess - at_hand_bytes();
  state.has_slack = unaccounted > max_slack;
  state.is_odd = unaccounted > max_odd;
  return state;
}

void MemoryBound::Accept() {
  const std::int64_t now = MeasureMemory().resident_bytes;
  const std::lock_guard lock(mutex_);
  if (num_loading_ > 0) return;
  base_bytes_ = now;
  max_virtual_bytes_ = MaxVirtualBytes();
}

}  // namespace scanloc::server
