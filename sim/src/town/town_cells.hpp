#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace scanloc::sim {

/// The key, unique in any town, of the square cell that holds a point.
inline std::uint64_t CellKey(const Eigen::Vector2d& point, double cell_m) {
  const auto column = static_cast<std::int64_t>(std::floor(point.x() / cell_m));
  const auto row = static_cast<std::int64_t>(std::floor(point.y() / cell_m));
  return (static_cast<std::uint64_t>(column) << 32) ^
         (static_cast<std::uint64_t>(row) & 0xFFFFFFFFU);
}

/// Calls visit(key) for every cell that touches the rectangle, row by row.
template <typename Visitor>
void VisitCells(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double cell_m,
                Visitor&& visit) {
  const double last_x = std::floor(high.x() / cell_m);
  const double last_y = std::floor(high.y() / cell_m);
  for (double y = std::floor(low.y() / cell_m); y <= last_y; ++y) {
    for (double x = std::floor(low.x() / cell_m); x <= last_x; ++x) {
      visit(CellKey({(x + 0.5) * cell_m, (y + 0.5) * cell_m}, cell_m));
    }
  }
}

}  // namespace scanloc::sim
