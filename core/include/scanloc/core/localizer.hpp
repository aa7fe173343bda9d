#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {

/// What one query may choose for itself; the rest are the map's parameters.
struct QueryOptions {
  std::optional<Method> method;  ///< none: DefaultMethod of the map
  /// k, in [1, limits::kMaxCandidates]; none: the map's. With `auto`: places taken from each kind
  /// of context; none: AutoSearch's own.
  std::optional<int> num_candidates;
  std::optional<double> threshold;       ///< τ, in [0, 1]; none: the map's. Not with `auto`
  std::optional<double> min_confidence;  ///< in [0, 1]; none: the map's. Only with `auto`
  int max_answers = 1;                   ///< candidates told in the answer, best first
  std::int64_t (*now_ns)() = nullptr;    ///< monotonic clock for StageTimes; null: not measured
  /// With `auto` and a clock: verification ends after so long, with the best answer so far; 0: when
  /// it is done.
  std::int64_t budget_ns = 0;
  /// One a place of the map: true where it is not looked at, as if it were not there. Null: all
  /// are.
  const std::vector<bool>* excluded = nullptr;
  /// Asked now and then while searching; once it says true, the search ends with Cancelled.
  std::function<bool()> is_unwanted;
};

class AutoSearch;
class Tracker;

/// Answers wake-up queries against one map: the paper's three stages (Sec. V), and `auto`.
/// Immutable after Create; any number of threads may call Localize at once, and the same map and
/// the same descriptor always give the same answer.
class Localizer {
 public:
  /// Builds the k-d trees: O(n log n) in the map's entries. InvalidArgument if the map's parameters
  /// are bad.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const Localizer>> Create(
      std::shared_ptr<const Map> map);

  /// InvalidArgument: options out of range, or a descriptor of other shapes than the map's.
  /// FailedPrecondition: the map does not serve the method. Cancelled: options.is_unwanted.
  [[nodiscard]] absl::StatusOr<Answer> Localize(const ScanDescriptor& query,
                                                const QueryOptions& options = {}) const;

  [[nodiscard]] const Map& map() const { return *map_; }

 private:
  friend class Tracker;

  explicit Localizer(std::shared_ptr<const Map> map);

  /// What is to be refused, whatever the method; or an answer that needs no search.
  [[nodiscard]] absl::Status CheckQuery(const ScanDescriptor& query, const Method& method,
                                        const QueryOptions& options) const;
  [[nodiscard]] Answer LocalizeByContext(const ScanDescriptor& query, const Method& method,
                                         const QueryOptions& options) const;
  [[nodiscard]] Answer LocalizeByStructure(const ScanDescriptor& query,
                                           const QueryOptions& options) const;

  std::shared_ptr<const Map> map_;
  std::optional<KeyIndex> polar_index_;
  std::optional<KeyIndex> cart_index_;
  std::shared_ptr<const AutoSearch> auto_search_;  // null where the map holds no structures
};

}  // namespace scanloc
