#include "scanloc/mapdb/learn_scale.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "scanloc/core/scan/voxel_filter.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxSample = 32;
/// Half of what a scan sees lies nearer than this in rooms, homes, offices, halls and aisles (3 to
/// 11.3 m), and farther in tunnels, streets and on a campus (12.5 to 35 m).
constexpr double kIndoors_m = 12.0;
constexpr double kIndoorScale = 0.35;

/// Not of none.
double Median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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
    if (!ranges_m.empty()) reaches_m.push_back(Median(ranges_m));
  }
  const bool is_indoors = !reaches_m.empty() && Median(reaches_m) < kIndoors_m;
  return is_indoors ? kIndoorScale : 1.0;
}

}  // namespace scanloc::mapdb
