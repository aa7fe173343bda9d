#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace scanloc {

/// How one call is run. Borrowed for the call and stored nowhere.
struct SearchControl {
  /// Monotonic, for StageTimes and the deadline; null: nothing is measured, and nothing is late.
  std::int64_t (*now_ns)() = nullptr;
  /// By that clock. With `auto`, verification ends then, with the best answer so far; 0: when it is
  /// done.
  std::int64_t deadline_ns = 0;
  /// Asked now and then while searching, by both parts that run_both runs; once it says true the
  /// call ends with Cancelled.
  std::function<bool()> is_unwanted = nullptr;
  /// Runs two parts of a large search at once (scanloc/jobs, RunBoth). Null: one after the other.
  using Part = std::function<void()>;
  void (*run_both)(const Part& first, const Part& second) = nullptr;
  /// One a place of the map: true where it is not looked at, as if it were not there. Null: all
  /// are.
  const std::vector<bool>* excluded = nullptr;

  [[nodiscard]] std::int64_t Now_ns() const { return now_ns == nullptr ? 0 : now_ns(); }
  [[nodiscard]] bool IsUnwanted() const { return is_unwanted && is_unwanted(); }
  /// Unwanted, or late.
  [[nodiscard]] bool IsOver() const {
    return IsUnwanted() || (now_ns != nullptr && deadline_ns > 0 && now_ns() >= deadline_ns);
  }
  [[nodiscard]] bool Excludes(std::size_t place) const {
    return excluded != nullptr && (*excluded)[place];
  }
  void RunBoth(const Part& first, const Part& second) const {
    if (run_both != nullptr) return run_both(first, second);
    first();
    second();
  }
};

/// Measured by a clock that is monotonic, and late after budget_ns from now on; 0: never.
[[nodiscard]] inline SearchControl TimedBy(std::int64_t (*now_ns)(), std::int64_t budget_ns = 0) {
  return {.now_ns = now_ns, .deadline_ns = budget_ns > 0 ? now_ns() + budget_ns : 0};
}

}  // namespace scanloc
