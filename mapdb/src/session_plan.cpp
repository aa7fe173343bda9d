#include "session_plan.hpp"

#include "absl/strings/str_cat.h"
#include "encoding.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::mapdb {

absl::Status Validate(const SessionPlan& plan) {
  RETURN_IF_ERROR(CheckName("the session", plan.name));
  if (plan.scans.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("session '", plan.name, "' has no scan; give at least one"));
  }
  if (plan.scans.size() > static_cast<std::size_t>(limits::kMaxPlaces)) {
    return absl::InvalidArgumentError(absl::StrCat("session '", plan.name, "' has ",
                                                   plan.scans.size(), " scans; the most is ",
                                                   limits::kMaxPlaces));
  }
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    const PlannedScan& scan = plan.scans[i];
    RETURN_IF_ERROR(CheckName(absl::StrCat("scan ", i), scan.name));
    if (absl::Status status = CheckPose(scan.T_map_place); !status.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat("scan ", i, " ('", scan.name, "'): ", status.message()));
    }
  }
  return absl::OkStatus();
}

std::string PlanHash(const SessionPlan& plan) {
  Hasher hasher;
  hasher.Add("plan").Add(plan.name);
  for (const PlannedScan& scan : plan.scans) {
    hasher.Add(scan.name).Add(scan.stamp_ns).Add(EncodePose(scan.T_map_place));
  }
  return hasher.Digest128();
}

std::string DescribeDifference(const SessionRow& stored, const std::vector<PlaceRow>& places,
                               const SessionPlan& plan) {
  if (stored.name != plan.name) {
    return absl::StrCat("it is named '", stored.name, "', not '", plan.name, "'");
  }
  const auto num_scans = static_cast<std::int64_t>(plan.scans.size());
  if (stored.num_scans != num_scans) {
    return absl::StrCat("it has ", stored.num_scans, " scans, not ", num_scans);
  }
  std::size_t next = 0;
  for (const PlaceRow& row : places) {
    while (next < plan.scans.size() && plan.scans[next].name != row.scan) ++next;
    if (next == plan.scans.size()) {
      return absl::StrCat("its scan '", row.scan, "' is not among these, or in another order");
    }
    const PlannedScan& scan = plan.scans[next++];
    if (scan.stamp_ns != row.stamp_ns) {
      return absl::StrCat("its scan '", row.scan, "' has stamp ", row.stamp_ns, " ns, not ",
                          scan.stamp_ns, " ns");
    }
    if (row.pose != EncodePose(scan.T_map_place)) {
      return absl::StrCat("its scan '", row.scan, "' has another pose");
    }
  }
  return "names, stamps or poses of scans that are not yet in the map are others";
}

}  // namespace scanloc::mapdb
