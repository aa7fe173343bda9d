#include "scanloc/mapdb/learn_scale.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "scanloc/core/median.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/voxel_filter.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxSample = 32;
/// Half of what a scan sees lies nearer than this in rooms, homes and offices (3 to 8 m),
constexpr double kRooms_m = 8.0;
/// and farther than this in streets and on a campus (12.5 to 35 m). Between the two are halls and
/// aisles, but a narrow part of a campus, tunnels and car parks, too.
constexpr double kStreets_m = 12.0;
/// So many times as many posts are seen by the small scale as by that of streets in halls and
/// aisles (2.06 to 4.3 times), fewer in the others, but for car parks where what lies low is seen
/// (0.9 to 1.9).
constexpr double kFinePosts = 1.95;
constexpr double kIndoorScale = 0.35;

/// A number told of a scan, or none where it shows nothing.
using Measure = std::function<std::optional<double>(const PointCloud&)>;

/// Its median over a sample of the scans; 0 of none.
absl::StatusOr<double> Sampled(const SessionPlan& plan, const ScanLoader& load_scan,
                               const Measure& measure) {
  std::vector<double> values;
  const std::size_t num_scans = plan.scans.size();
  const std::size_t num_sample = std::min(num_scans, kMaxSample);
  for (std::size_t k = 0; k < num_sample; ++k) {
    const absl::StatusOr<PointCloud> points = load_scan(k * num_scans / num_sample);
    if (absl::IsCancelled(points.status())) return points.status();
    if (!points.ok()) continue;
    if (const std::optional<double> value = measure(*points)) values.push_back(*value);
  }
  return values.empty() ? 0.0 : Median(values);
}

absl::StatusOr<double> NumPosts(Params params, double scale, const SessionPlan& plan,
                                const ScanLoader& load_scan) {
  params.automatic = AutoParamsAtScale(scale);
  ASSIGN_OR_RETURN(Describer describer, Describer::Create(params));
  return Sampled(plan, load_scan, [&](const PointCloud& points) {
    return static_cast<double>(describer.Describe(points).structure.posts.size());
  });
}

}  // namespace

absl::StatusOr<double> LearnScale(const Params& params, const SessionPlan& plan,
                                  const ScanLoader& load_scan) {
  VoxelFilter filter(params.voxel_size_m);
  ASSIGN_OR_RETURN(
      const double reach_m, Sampled(plan, load_scan, [&](const PointCloud& points) {
        std::vector<double> ranges_m;
        for (const Point& p : filter.Apply(points)) {
          ranges_m.push_back(std::hypot(static_cast<double>(p.x), static_cast<double>(p.y)));
        }
        return ranges_m.empty() ? std::nullopt : std::optional(Median(ranges_m));
      }));
  if (reach_m == 0.0 || reach_m >= kStreets_m) return 1.0;
  if (reach_m < kRooms_m) return kIndoorScale;
  ASSIGN_OR_RETURN(const double few, NumPosts(params, 1.0, plan, load_scan));
  ASSIGN_OR_RETURN(const double many, NumPosts(params, kIndoorScale, plan, load_scan));
  return many < kFinePosts * few ? 1.0 : kIndoorScale;
}

}  // namespace scanloc::mapdb
