#include "cli/drive_plan.hpp"

#include <utility>

#include "cli/interrupt.hpp"

namespace scanloc::cli {

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
    absl::StatusOr<SeenScan> seen = ReadSeenScan(frames[i].file(), mount);
    if (!seen.ok()) return seen.status();
    return std::move(seen->scan.points);
  };
}

}  // namespace scanloc::cli
