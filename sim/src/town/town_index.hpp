#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

/// Finds the solids around a point. Immutable; any number of threads may look.
class SolidIndex {
 public:
  explicit SolidIndex(const std::vector<Solid>& solids);

  /// Appends every solid that comes within radius_m of the point, and some that do not, in an order
  /// that depends on the point alone.
  void AppendAround(const Eigen::Vector2d& point, double radius_m, std::vector<Solid>& to) const;

 private:
  std::unordered_map<std::uint64_t, std::vector<Solid>> cells_;  // by the cell of the centre
  double max_radius_m_ = 0.0;
};

}  // namespace scanloc::sim
