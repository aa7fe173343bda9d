#include "ageing_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

namespace scanloc::report {
namespace {

/// A place that was seen less often says nothing yet.
constexpr std::int64_t kMinSeen = 3;
/// What lies below happens at any sound place: traffic, an odd lane. Measured over made towns
/// (docs/operations.md).
constexpr double kClear = 0.44;
constexpr double kBeside = 0.34;
constexpr double kTogether_m = 10.0;
constexpr double kBeside_m = 16.0;
constexpr double kSameFloor_m = 1.5;

struct Seen {
  std::int32_t place = 0;
  Eigen::Vector3d at;
  std::int64_t num = 0;
  double alone = 0.0;
  double together = 0.0;
};

/// Places by position.
class Grid {
 public:
  explicit Grid(std::span<const Seen> all) : all_(all) {
    for (std::size_t i = 0; i < all.size(); ++i) cells_[CellOf(all[i].at)].push_back(i);
  }

  template <typename Visit>
  void VisitNear(const Eigen::Vector3d& at, double within_m, Visit&& visit) const {
    const auto [column, row] = CellOf(at);
    for (int n = 0; n < 9; ++n) {
      const auto found = cells_.find({column + n % 3 - 1, row + n / 3 - 1});
      if (found == cells_.end()) continue;
      for (const std::size_t i : found->second) {
        const Eigen::Vector3d offset = all_[i].at - at;
        if (offset.head<2>().norm() <= within_m && std::abs(offset.z()) <= kSameFloor_m) visit(i);
      }
    }
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;
  static Cell CellOf(const Eigen::Vector3d& at) {
    return {static_cast<std::int64_t>(std::floor(at.x() / kBeside_m)),
            static_cast<std::int64_t>(std::floor(at.y() / kBeside_m))};
  }

  std::span<const Seen> all_;
  std::map<Cell, std::vector<std::size_t>> cells_;
};

}  // namespace

std::vector<std::int32_t> AgeingPlaces(const MapUse& use, std::span<const Place> places) {
  std::vector<Seen> seen;
  for (const auto& [place, of_place] : use.places) {
    const std::int64_t num = of_place.num_found + of_place.num_refused;
    if (num == 0 || static_cast<std::size_t>(place) >= places.size()) continue;
    const Eigen::Vector3d at = places[static_cast<std::size_t>(place)].T_map_place.translation();
    seen.push_back({place, at, num, TroubleOf(of_place), 0.0});
  }
  const Grid grid(seen);
  for (Seen& one : seen) {
    std::vector<double> said;
    grid.VisitNear(one.at, kTogether_m, [&](std::size_t k) { said.push_back(seen[k].alone); });
    const auto middle = said.begin() + static_cast<std::ptrdiff_t>(said.size() / 2);
    std::nth_element(said.begin(), middle, said.end());
    one.together = *middle;
  }
  std::vector<bool> ages(seen.size(), false);
  for (const Seen& one : seen) {
    if (one.num < kMinSeen || one.together < kClear) continue;
    grid.VisitNear(one.at, kBeside_m, [&](std::size_t k) {
      if (seen[k].num >= kMinSeen && seen[k].together >= kBeside) ages[k] = true;
    });
  }
  std::vector<const Seen*> ageing;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (ages[i]) ageing.push_back(&seen[i]);
  }
  std::ranges::stable_sort(ageing,
                           [](const Seen* a, const Seen* b) { return a->alone > b->alone; });
  std::vector<std::int32_t> worst_first;
  worst_first.reserve(ageing.size());
  for (const Seen* one : ageing) worst_first.push_back(one->place);
  return worst_first;
}

}  // namespace scanloc::report
