#pragma once

#include <cstdint>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/descriptor.hpp"

/// What baselines share.
namespace scanloc::eval {

/// Time since it was made, by a clock that may be null.
class Stopwatch {
 public:
  explicit Stopwatch(std::int64_t (*now_ns)()) : now_ns_(now_ns), start_ns_(Now_ns()) {}

  /// 0 without a clock.
  [[nodiscard]] std::int64_t Elapsed_ns() const { return Now_ns() - start_ns_; }

 private:
  [[nodiscard]] std::int64_t Now_ns() const { return now_ns_ == nullptr ? 0 : now_ns_(); }

  std::int64_t (*now_ns_)();
  std::int64_t start_ns_;
};

inline const ContextTable& TableOf(const Map& map, DescriptorKind kind) {
  return kind == DescriptorKind::kPolar ? map.polar : map.cart;
}

inline const Context& ContextOf(const ScanDescriptor& descriptor, DescriptorKind kind) {
  return kind == DescriptorKind::kPolar ? descriptor.polar : descriptor.cart;
}

}  // namespace scanloc::eval
