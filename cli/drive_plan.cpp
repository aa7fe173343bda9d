#include "cli/drive_plan.hpp"

#include <utility>

#include "cli/interrupt.hpp"
#include "scanloc/core/map/spacing.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {

std::vector<dataset::Frame> Thinned(std::vector<dataset::Frame> frames, double spacing_m) {
  std::vector<Pose> poses;
  poses.reserve(frames.size());
  for (const dataset::Frame& frame : frames) poses.push_back(frame.T_map_sensor);
  std::vector<dataset::Frame> kept;
  for (const std::size_t i : SelectBySpacing(poses, spacing_m)) {
    kept.push_back(std::move(frames[i]));
  }
  return kept;
}

mapdb::SessionPlan PlanOf(const std::string& name, const std::vector<dataset::Frame>& frames,
                          const SensorMount& mount) {
  mapdb::SessionPlan plan;
  plan.name = name;
  for (const dataset::Frame& frame : frames) {
    plan.scans.push_back({frame.name, frame.stamp_ns, TurnedOfSensor(mount, frame.T_map_sensor)});
  }
  return plan;
}

mapdb::ScanLoader LoaderOf(const std::vector<dataset::Frame>& frames, const SensorMount& mount) {
  return [&frames, mount](std::size_t i) -> absl::StatusOr<PointCloud> {
    if (Interrupted()) return absl::CancelledError("interrupted before anything was written");
    ASSIGN_OR_RETURN(SeenScan seen, ReadSeenScan(frames[i].file(), mount));
    return std::move(seen.scan.points);
  };
}

}  // namespace scanloc::cli
