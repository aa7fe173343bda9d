#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "scanloc/core/map/map.hpp"

namespace scanloc {

/// The places of a map by where they are: a 3-D tree, or several where the map grew since. Any
/// number of threads may search it.
class PlaceTree {
 public:
  /// O(n log n). Keeps a reference to the places.
  explicit PlaceTree(const std::vector<Place>& places);
  ~PlaceTree();

  /// Takes in the places that were appended. Amortised O(log² n) a place; not beside a search.
  void Extend();

  /// The place nearest to a position, of those equally near the lowest; none where all are excluded
  /// (SearchControl::excluded). O(log n), but for those that are excluded.
  [[nodiscard]] std::optional<std::size_t> Nearest(
      const Eigen::Vector3d& position_m, const std::vector<bool>* excluded = nullptr) const;

 private:
  struct Trees;
  const std::unique_ptr<Trees> trees_;
};

}  // namespace scanloc
