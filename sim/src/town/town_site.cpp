#include "town/town_site.hpp"

#include <algorithm>
#include <cmath>

#include "town/town_cells.hpp"

namespace scanloc::sim {
namespace {

constexpr double kSiteCell_m = 16.0;

double HalfWidth(const Solid& solid) {
  return solid.shape == SolidShape::kBox ? solid.half_width_m : solid.half_length_m;
}

/// Half the extent of the footprint along a unit vector.
double HalfExtent(const Solid& solid, const Eigen::Vector2d& direction) {
  return solid.half_length_m * std::abs(solid.axis.dot(direction)) +
         HalfWidth(solid) * std::abs(LeftOf(solid.axis).dot(direction));
}

double DistanceToPoint(const Solid& solid, const Eigen::Vector2d& point) {
  const Eigen::Vector2d offset = point - solid.center;
  const double along = std::abs(offset.dot(solid.axis)) - solid.half_length_m;
  const double across = std::abs(offset.dot(LeftOf(solid.axis))) - HalfWidth(solid);
  return Eigen::Vector2d(std::max(along, 0.0), std::max(across, 0.0)).norm();
}

/// Whether some side of either box separates them by the gap.
bool AreApart(const Solid& a, const Solid& b, double gap_m) {
  const Eigen::Vector2d offset = b.center - a.center;
  const auto separates = [&](const Eigen::Vector2d& direction) {
    return std::abs(offset.dot(direction)) >=
           HalfExtent(a, direction) + HalfExtent(b, direction) + gap_m;
  };
  return separates(a.axis) || separates(LeftOf(a.axis)) || separates(b.axis) ||
         separates(LeftOf(b.axis));
}

}  // namespace

template <typename Visitor>
void Site::VisitAround(const Solid& solid, double reach_m, Visitor&& visit) {
  const Eigen::Vector2d half(HalfExtent(solid, Eigen::Vector2d::UnitX()) + reach_m,
                             HalfExtent(solid, Eigen::Vector2d::UnitY()) + reach_m);
  VisitCells(solid.center - half, solid.center + half, kSiteCell_m, visit);
}

void Site::KeepFree(const Path& path, double radius_m) { KeepFree(path, radius_m, 0.0); }

void Site::KeepFree(const Path& path, double radius_m, double left_m) {
  max_disc_m_ = std::max(max_disc_m_, radius_m);
  for (double s = 0.0; s <= path.length_m(); s += 1.0) {
    const Eigen::Vector2d center = path.At(s) + LeftOf(path.Tangent(s)) * left_m;
    discs_[CellKey(center, kSiteCell_m)].push_back({center, radius_m});
  }
}

bool Site::Fits(const Solid& solid, double gap_m) const {
  bool fits = true;
  VisitAround(solid, max_disc_m_, [&](std::uint64_t cell) {
    const auto discs = discs_.find(cell);
    if (!fits || discs == discs_.end()) return;
    fits = std::ranges::none_of(discs->second, [&](const Disc& disc) {
      return DistanceToPoint(solid, disc.center) < disc.radius_m;
    });
  });
  VisitAround(solid, gap_m, [&](std::uint64_t cell) {
    const auto boxes = boxes_.find(cell);
    if (!fits || boxes == boxes_.end()) return;
    fits = std::ranges::all_of(boxes->second,
                               [&](const Solid& box) { return AreApart(solid, box, gap_m); });
  });
  return fits;
}

void Site::Take(const Solid& solid) {
  VisitAround(solid, 0.0, [&](std::uint64_t cell) { boxes_[cell].push_back(solid); });
}

}  // namespace scanloc::sim
