#include "town/town_index.hpp"

#include <algorithm>

#include "town/town_cells.hpp"

namespace scanloc::sim {
namespace {

constexpr double kCell_m = 32.0;

}  // namespace

SolidIndex::SolidIndex(const std::vector<Solid>& solids) {
  for (const Solid& solid : solids) {
    max_radius_m_ = std::max(max_radius_m_, solid.half_length_m + solid.half_width_m);
    cells_[CellKey(solid.center, kCell_m)].push_back(solid);
  }
}

void SolidIndex::AppendAround(const Eigen::Vector2d& point, double radius_m,
                              std::vector<Solid>& to) const {
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(radius_m + max_radius_m_);
  VisitCells(point - reach, point + reach, kCell_m, [&](std::uint64_t key) {
    const auto cell = cells_.find(key);
    if (cell != cells_.end()) to.insert(to.end(), cell->second.begin(), cell->second.end());
  });
}

}  // namespace scanloc::sim
