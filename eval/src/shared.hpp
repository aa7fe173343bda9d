#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/eval/baseline.hpp"

/// What baselines share, and those that only MakeBaseline knows; null for a name of no such one.
namespace scanloc::eval {

/// pc-key, cc-key, a-pc-key or a-cc-key.
[[nodiscard]] std::unique_ptr<Baseline> MakeKeyOnly(const std::string& name);
/// a-pc-trees or a-cc-trees.
[[nodiscard]] std::unique_ptr<Baseline> MakeSeveralTrees(const std::string& name);
/// pc, cc, a-pc or a-cc, and -mean, -count or -bits.
[[nodiscard]] std::unique_ptr<Baseline> MakeBinEncoding(const std::string& name,
                                                        const Params& params);

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
