#include "scanloc/slam/close_loops.hpp"

#include <algorithm>
#include <utility>

#include "described_drive.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::slam {
namespace {

constexpr int kMaxPasses = 4;

}  // namespace

std::size_t ClosedDrive::num_on() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(constraints, [](const FoundConstraint& c) { return c.is_on; }));
}

absl::StatusOr<ClosedDrive> CloseLoops(const Params& params, const mapdb::SessionPlan& plan,
                                       const mapdb::ScanLoader& load_scan,
                                       const DriveOptions& options) {
  RETURN_IF_ERROR(Validate(options));
  RETURN_IF_ERROR(mapdb::Validate(plan));
  RETURN_IF_ERROR(scanloc::Validate(options.query, params));
  ASSIGN_OR_RETURN(const DescribedDrive described, DescribeDrive(params, plan, load_scan, options));

  ClosedDrive drive;
  drive.num_looked_at = described.size();
  for (const mapdb::PlannedScan& scan : plan.scans) drive.T_map_scan.push_back(scan.T_map_place);
  const std::vector<Constraint> ahead = LookAhead(params, described, plan);
  // A spot that was passed twice with contradicting poses is ambiguous for the third visit: each
  // pass looks again with better poses, until no more loops hold.
  while (drive.num_passes < kMaxPasses) {
    ASSIGN_OR_RETURN(std::vector<FoundConstraint> loops,
                     FindLoops(params, described, drive.T_map_scan, options));
    ++drive.num_passes;
    const std::size_t num_before = drive.num_on();
    if (loops.empty()) break;
    RETURN_IF_ERROR(OptimizeDrive(plan, ahead, options.graph, std::move(loops), drive));
    if (drive.num_on() <= num_before) break;
  }
  return drive;
}

}  // namespace scanloc::slam
