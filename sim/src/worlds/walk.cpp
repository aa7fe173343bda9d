#include "worlds/walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace scanloc::sim {
namespace {

constexpr double kAhead_m = 0.35;
constexpr double kSteepestRamp = 0.25;

}  // namespace

double WayOf(const Eigen::Vector3d& step) {
  const double plane2 = step.x() * step.x() + step.y() * step.y();
  return plane2 < 1e-12 ? 0.0 : std::sqrt(plane2 + step.z() * step.z());
}

Walk::Walk(std::vector<Eigen::Vector3d> corners) : corners_(std::move(corners)) {
  double along = 0.0;
  ends_m_.push_back(along);
  for (std::size_t i = 0; i + 1 < corners_.size(); ++i) {
    const Eigen::Vector3d step = corners_[i + 1] - corners_[i];
    along += WayOf(step);
    ends_m_.push_back(along);
  }
}

Eigen::Vector3d Walk::At(double along_m) const {
  const double along = std::clamp(along_m, 0.0, length_m());
  const auto after = std::upper_bound(ends_m_.begin() + 1, ends_m_.end() - 1, along);
  const auto i = static_cast<std::size_t>(after - ends_m_.begin());
  const double length = ends_m_[i] - ends_m_[i - 1];
  const double part = length > 0.0 ? (along - ends_m_[i - 1]) / length : 1.0;
  return corners_[i - 1] + (corners_[i] - corners_[i - 1]) * part;
}

Eigen::Vector2d Walk::Heading(double along_m) const {
  // One may turn round on the spot or ride a lift: then as one came there.
  for (double reach = kAhead_m; reach < length_m() + kAhead_m; reach *= 1.5) {
    const Eigen::Vector3d step = At(along_m + reach) - At(along_m - reach);
    const double norm = std::sqrt(step.x() * step.x() + step.y() * step.y());
    if (norm > 0.2 * reach) return step.head<2>() / norm;
    const Eigen::Vector3d come = At(along_m) - At(along_m - reach);
    const double come_m = std::sqrt(come.x() * come.x() + come.y() * come.y());
    if (come_m > 0.8 * reach) return come.head<2>() / come_m;
  }
  return Eigen::Vector2d::UnitX();
}

double Walk::Slope(double along_m) const {
  const Eigen::Vector3d step = At(along_m + kAhead_m) - At(along_m - kAhead_m);
  const double norm = std::sqrt(step.x() * step.x() + step.y() * step.y());
  if (std::abs(step.z()) > kSteepestRamp * norm) return 0.0;
  return norm > 0.0 ? step.z() / norm : 0.0;
}

}  // namespace scanloc::sim
