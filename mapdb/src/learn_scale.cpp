#include "scanloc/mapdb/learn_scale.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "scanloc/core/scan/voxel_filter.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxSample = 32;
/// Three quarters of what a scan sees lie nearer than this in rooms, homes, offices, halls and
/// aisles (3 to 16 m), and farther in car parks, tunnels, streets and on a campus (20 to 50 m).
constexpr double kIndoors_m = 17.0;
constexpr double kIndoorScale = 0.35;

/// The value that so large a share of them does not reach. Not of none.
double Quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

absl::StatusOr<double> LearnScale(const Params& params, const SessionPlan& plan,
                                  const ScanLoader& load_scan) {
  VoxelFilter filter(params.voxel_size_m);
  std::vector<double> reaches_m;
  const std::size_t num_scans = plan.scans.size();
  const std::size_t num_sample = std::min(num_scans, kMaxSample);
  for (std::size_t k = 0; k < num_sample; ++k) {
    const absl::StatusOr<PointCloud> points = load_scan(k * num_scans / num_sample);
    if (absl::IsCancelled(points.status())) return points.status();
    if (!points.ok()) continue;
    std::vector<double> ranges_m;
    for (const Point& p : filter.Apply(*points)) {
      ranges_m.push_back(std::hypot(static_cast<double>(p.x), static_cast<double>(p.y)));
    }
    if (!ranges_m.empty()) reaches_m.push_back(Quantile(ranges_m, 0.75));
  }
  const bool is_indoors = !reaches_m.empty() && Quantile(reaches_m, 0.5) < kIndoors_m;
  return is_indoors ? kIndoorScale : 1.0;
}

}  // namespace scanloc::mapdb
