#include "scanloc/mapdb/check_session.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/structural/consistency.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxPairs = 40;
constexpr std::size_t kMaxQueries = 40;
/// Answers that must have been found before they are believed against the poses.
constexpr std::size_t kMinFound = 3;

/// The descriptor of a scan; none if it cannot be read.
absl::StatusOr<std::optional<ScanDescriptor>> Look(const ScanLoader& load_scan, std::size_t scan,
                                                   Describer& describer) {
  const absl::StatusOr<PointCloud> points = load_scan(scan);
  if (absl::IsCancelled(points.status())) return points.status();
  if (!points.ok()) return std::optional<ScanDescriptor>();
  return std::optional(describer.Describe(*points));
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string Motion(const Pose& pose) {
  const PoseDifference difference = DifferenceOf(Pose::Identity(), pose);
  return absl::StrFormat("%.2f m and %.1f deg", pose.translation().norm(), difference.heading_deg);
}

}  // namespace

absl::Status CheckPoses(const Params& params, const SessionPlan& plan,
                        const ScanLoader& load_scan) {
  if (!params.structure.enabled) return absl::OkStatus();
  absl::StatusOr<Describer> describer = Describer::Create(params);
  if (!describer.ok()) return describer.status();
  std::vector<Pose> poses;
  poses.reserve(plan.scans.size());
  for (const PlannedScan& scan : plan.scans) poses.push_back(scan.T_map_place);

  std::vector<PairCheck> checks;
  for (const std::size_t i : PairsToCheck(poses, kMaxPairs)) {
    absl::StatusOr<std::optional<ScanDescriptor>> first = Look(load_scan, i, *describer);
    if (!first.ok()) return first.status();
    absl::StatusOr<std::optional<ScanDescriptor>> second = Look(load_scan, i + 1, *describer);
    if (!second.ok()) return second.status();
    if (!*first || !*second) continue;
    checks.push_back(
        CheckPair({i, i + 1, std::move((*first)->structure), std::move((*second)->structure)},
                  poses[i], poses[i + 1], params.automatic));
  }
  const ConsistencyReport report = JudgeDrive(checks, poses);
  if (!report.is_inconsistent) return absl::OkStatus();
  const PairCheck& worst =
      *std::max_element(checks.begin(), checks.end(), [](const PairCheck& a, const PairCheck& b) {
        const auto weight = [](const PairCheck& c) {
          return c.verdict == PairCheck::Verdict::kContradicts ? c.score : 0.0;
        };
        return weight(a) < weight(b);
      });
  std::string example;
  if (worst.verdict == PairCheck::Verdict::kContradicts) {
    example = absl::StrFormat(
        "; for example '%s' and '%s' are %s apart by their poses, %s by what they show",
        plan.scans[worst.first].name, plan.scans[worst.second].name, Motion(worst.told),
        Motion(worst.shown));
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "the poses contradict the scans: of %d pairs of successive scans %d lie on each other "
      "elsewhere than their poses say, and %d do not look alike though the poses put them side by "
      "side%s. Likely cause: %s",
      checks.size(), report.num_contradicting, report.num_strangers, example, report.likely_cause));
}

absl::Status CheckFrame(const std::string& map_path, const SessionPlan& plan,
                        const ScanLoader& load_scan) {
  absl::StatusOr<Map> map = OpenMap(map_path);
  if (!map.ok()) return map.status();
  if (!map->params.structure.enabled || map->places.empty()) return absl::OkStatus();
  absl::StatusOr<Describer> describer = Describer::Create(map->params);
  if (!describer.ok()) return describer.status();
  const absl::StatusOr<std::shared_ptr<const Localizer>> localizer =
      Localizer::Create(std::make_shared<const Map>(*std::move(map)));
  if (!localizer.ok()) return localizer.status();

  std::vector<double> planes_m;
  std::vector<double> heights_m;
  std::vector<double> headings_deg;
  std::size_t num_found = 0;
  const std::size_t num_queries = std::min(plan.scans.size(), kMaxQueries);
  for (std::size_t k = 0; k < num_queries; ++k) {
    const std::size_t i = k * plan.scans.size() / num_queries;
    const absl::StatusOr<std::optional<ScanDescriptor>> scan = Look(load_scan, i, *describer);
    if (!scan.ok()) return scan.status();
    if (!*scan) continue;
    const absl::StatusOr<Answer> answer = (*localizer)->Localize(**scan);
    if (!answer.ok()) return answer.status();
    if (answer->outcome != Outcome::kLocalized) continue;
    ++num_found;
    const PoseDifference difference =
        DifferenceOf(answer->candidates.front().T_map_query, plan.scans[i].T_map_place);
    if (!MissOf(difference).any()) continue;
    planes_m.push_back(difference.plane_m);
    heights_m.push_back(difference.height_m);
    headings_deg.push_back(difference.heading_deg);
  }
  if (num_found < kMinFound || planes_m.size() * 2 <= num_found) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "the same places are found in both drives, but their poses disagree: of %d scans of this "
      "drive %d are found in the map, %d of them elsewhere than their poses say, by %.2f m in the "
      "plane, %.2f m in height and %.1f deg (medians). Bring the drive into the map's frame first",
      num_queries, num_found, planes_m.size(), Median(planes_m), Median(heights_m),
      Median(headings_deg)));
}

}  // namespace scanloc::mapdb
