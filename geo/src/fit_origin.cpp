#include "scanloc/geo/fit_origin.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "absl/strings/str_format.h"
#include "scanloc/core/median.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::geo {
namespace {

constexpr std::size_t kMinFixes = 5;
constexpr double kMinSpan_m = 20.0;
/// Farther off is a jump.
constexpr double kAgrees_m = 5.0;
constexpr int kNumTrials = 500;
constexpr int kNumRefinements = 5;

/// How the map lies over east, north and up of a point.
struct Laid {
  double angle = 0.0;  // from map to east and north, counterclockwise [rad]
  Eigen::Vector2d t_east_map = Eigen::Vector2d::Zero();

  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& at_map) const {
    return Eigen::Rotation2Dd(angle) * at_map + t_east_map;
  }
};

/// A fix in the plane: map, and east and north; both about points near the fixes.
struct Pair {
  Eigen::Vector2d map;
  Eigen::Vector2d east_north;
};

double Miss(const Laid& laid, const Pair& pair) {
  return (laid(pair.map) - pair.east_north).norm();
}

Laid ByTwo(const Pair& a, const Pair& b) {
  const Eigen::Vector2d map = b.map - a.map;
  const Eigen::Vector2d east_north = b.east_north - a.east_north;
  Laid laid;
  laid.angle = std::atan2(east_north.y(), east_north.x()) - std::atan2(map.y(), map.x());
  laid.t_east_map = 0.5 * (a.east_north + b.east_north) -
                    Eigen::Rotation2Dd(laid.angle) * (0.5 * (a.map + b.map));
  return laid;
}

/// Least squares over those that agree.
Laid Refine(const Laid& laid, const std::vector<Pair>& pairs) {
  Eigen::Vector2d mean_map = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_east = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const Pair& pair : pairs) {
    if (Miss(laid, pair) > kAgrees_m) continue;
    mean_map += pair.map;
    mean_east += pair.east_north;
    count += 1.0;
  }
  if (count < 2.0) return laid;
  mean_map /= count;
  mean_east /= count;
  double along = 0.0;
  double across = 0.0;
  for (const Pair& pair : pairs) {
    if (Miss(laid, pair) > kAgrees_m) continue;
    const Eigen::Vector2d map = pair.map - mean_map;
    const Eigen::Vector2d east = pair.east_north - mean_east;
    along += map.dot(east);
    across += map.x() * east.y() - map.y() * east.x();
  }
  Laid refined;
  refined.angle = std::atan2(across, along);
  refined.t_east_map = mean_east - Eigen::Rotation2Dd(refined.angle) * mean_map;
  return refined;
}

Laid Lay(const std::vector<Pair>& pairs, double span_m) {
  std::mt19937_64 random(1);  // its numbers are the same everywhere
  Laid best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < kNumTrials; ++trial) {
    const Pair& a = pairs[random() % pairs.size()];
    const Pair& b = pairs[random() % pairs.size()];
    if ((a.map - b.map).norm() < 0.25 * span_m) continue;
    const Laid laid = ByTwo(a, b);
    double cost = 0.0;
    for (const Pair& pair : pairs) cost += std::min(Miss(laid, pair), kAgrees_m);
    if (cost >= best_cost) continue;
    best = laid;
    best_cost = cost;
  }
  for (int i = 0; i < kNumRefinements; ++i) best = Refine(best, pairs);
  return best;
}

/// One look at the fixes from a point on earth near them.
FittedOrigin FitAbout(const GeoOrigin& about, std::span<const Fix> fixes, double span_m) {
  const GeoFrame frame = *GeoFrame::Create(about);  // x east, y north
  std::vector<Pair> pairs;
  std::vector<double> rises_m;
  for (const Fix& fix : fixes) {
    const Eigen::Vector3d east_north_up = frame.ToMap(fix.position) - about.anchor_m;
    pairs.push_back({(fix.at_map_m - about.anchor_m).head<2>(), east_north_up.head<2>()});
    rises_m.push_back(east_north_up.z() - (fix.at_map_m.z() - about.anchor_m.z()));
  }
  const Laid laid = Lay(pairs, span_m);
  FittedOrigin fitted;
  for (const Pair& pair : pairs) {
    const double miss_m = Miss(laid, pair);
    if (miss_m > kAgrees_m) continue;
    ++fitted.num_used;
    fitted.rms_m += miss_m * miss_m;
    fitted.max_m = std::max(fitted.max_m, miss_m);
  }
  if (fitted.num_used > 0) {
    fitted.rms_m = std::sqrt(fitted.rms_m / static_cast<double>(fitted.num_used));
  }
  const Eigen::Vector3d anchor_east{laid.t_east_map.x(), laid.t_east_map.y(), Median(rises_m)};
  const GeoPosition there = frame.ToGeo(about.anchor_m + anchor_east);
  const double heading_deg = 90.0 - laid.angle * 180.0 / std::numbers::pi;
  fitted.origin = {there.latitude_deg, there.longitude_deg, there.altitude_m,
                   std::remainder(heading_deg, 360.0), about.anchor_m};
  return fitted;
}

}  // namespace

absl::StatusOr<FittedOrigin> FitOrigin(std::span<const Fix> fixes) {
  if (fixes.size() < kMinFixes) {
    return absl::FailedPreconditionError(
        absl::StrFormat("there are %d fixes at the times of places; at least %d are needed",
                        fixes.size(), kMinFixes));
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Fix& fix : fixes) middle += fix.at_map_m / static_cast<double>(fixes.size());
  double span_m = 0.0;
  for (const Fix& fix : fixes) {
    span_m = std::max(span_m, 2.0 * (fix.at_map_m - middle).head<2>().norm());
  }
  if (span_m < kMinSpan_m) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the places with fixes lie within %.1f m, which says nothing about the "
                        "heading; at least %g m are needed",
                        span_m, kMinSpan_m));
  }
  const GeoPosition& first = fixes.front().position;
  GeoOrigin about{first.latitude_deg, first.longitude_deg, first.altitude_m, 90.0, middle};
  RETURN_IF_ERROR(Validate(about));
  // North is another one some kilometres on: a second look from amid the map.
  FittedOrigin fitted = FitAbout(about, fixes, span_m);
  about = fitted.origin;
  about.heading_deg = 90.0;
  fitted = FitAbout(about, fixes, span_m);
  if (fitted.num_used * 2 < fixes.size()) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "no way to lay the map on earth agrees with half of the fixes within %g m; the best has "
        "%d of %d: are their times those of the scans?",
        kAgrees_m, fitted.num_used, fixes.size()));
  }
  return fitted;
}

}  // namespace scanloc::geo
