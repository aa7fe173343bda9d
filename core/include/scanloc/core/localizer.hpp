#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/search_control.hpp"

namespace scanloc {

class AutoSearch;
class ContextSearch;
class LoopDetector;
class Tracker;

/// Does tasks that know nothing of each other, in any order or at once; returns when all are done,
/// or why they were not.
using DoAll = std::function<absl::Status(std::span<const std::function<void()>> tasks)>;

/// Answers wake-up queries against one map: hands each to the method it asks for.
/// Immutable after Create; any number of threads may call Localize at once, and the same map, scan
/// and query always give the same answer.
class Localizer {
 public:
  /// Builds the k-d trees: O(n log n) in the map's entries; by do_all, or one after the other.
  /// Trees over blocks of keys that the map shares with another one (Map::ShareWith) are taken from
  /// that one's localizer, and are as those built would be. InvalidArgument if the map's parameters
  /// are bad, or its places do not agree on which direction is up (FindUp). The errors of do_all.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const Localizer>> Create(
      std::shared_ptr<const Map> map, const DoAll& do_all = nullptr,
      const Localizer* before = nullptr);
  /// The same for one method alone, with the trees of that: others are FailedPrecondition.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const Localizer>> CreateFor(
      std::shared_ptr<const Map> map, const Method& method);

  /// InvalidArgument: a query out of range, a prior that names a session which the map does not
  /// have, or a descriptor of other shapes than the map's.
  /// FailedPrecondition: the map, or this localizer, does not serve the method. Cancelled:
  /// control.is_unwanted. The errors of PayloadReader::Read.
  [[nodiscard]] absl::StatusOr<Answer> Localize(const ScanDescriptor& scan, const Query& query = {},
                                                const SearchControl& control = {}) const;

  [[nodiscard]] const Map& map() const { return *map_; }

 private:
  friend class LoopDetector;
  friend class Tracker;

  explicit Localizer(std::shared_ptr<const Map> map) : map_(std::move(map)) {}

  /// Makes the searches of all methods that the map serves, or of one.
  [[nodiscard]] absl::Status Prepare(const std::optional<Method>& only = std::nullopt,
                                     const DoAll& do_all = nullptr,
                                     const Localizer* before = nullptr);

  /// Takes in the places that were appended to the map. Not beside a call.
  [[nodiscard]] absl::Status Extend();

  /// What is to be refused, whatever the method.
  [[nodiscard]] absl::Status Check(const ScanDescriptor& scan, const Query& query,
                                   const SearchControl& control) const;

  std::shared_ptr<const Map> map_;
  // Null where the map does not hold what they search.
  std::shared_ptr<ContextSearch> polar_search_;
  std::shared_ptr<ContextSearch> cart_search_;
  std::shared_ptr<AutoSearch> auto_search_;
};

}  // namespace scanloc
