#include "scanloc/slam/compare.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "described_drive.hpp"
#include "scanloc/core/median.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/structural/consistency.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::slam {
namespace {

/// Others so near see the same [m].
constexpr double kNear_m = 8.0;
constexpr double kSameFloor_m = 1.5;
constexpr std::size_t kMostOthers = 3;
/// Fewer posts say nothing.
constexpr std::size_t kMinPosts = 40;
/// Poses of both visits are right within this.
constexpr PoseLimits kTold = {.plane_m = 1.5, .height_m = 5.0, .heading_deg = 10.0};
/// Neighbours of one visit that are judged together lie within this.
constexpr double kTogether_m = 10.0;
/// Share of the reach of posts.
constexpr double kLookedAt = 0.5;
/// Change is less than a share of the agreement that a quarter of all reach, which depends on
/// sensors and weather, and never above or below these: docs/maintenance.md measures it.
struct Bounds {
  double share, always, never;
};
constexpr Bounds kClear = {.share = 0.62, .always = 0.42, .never = 0.62};
/// The ends of a rebuilt street see much of what stays: so near to a place that has clearly changed
/// less is enough.
constexpr Bounds kBeside = {.share = 0.9, .always = 0.42, .never = 0.8};
constexpr double kBeside_m = 16.0;

/// Observations by position.
class Grid {
 public:
  explicit Grid(std::span<const Observation> all) : all_(all) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].structure.posts.size() >= kMinPosts) cells_[KeyOf(CellOf(all[i]))].push_back(i);
    }
  }

  /// Those near, nearest first.
  [[nodiscard]] std::vector<std::size_t> Near(const Observation& seen) const {
    std::vector<std::pair<double, std::size_t>> near;
    const Eigen::Vector2i cell = CellOf(seen);
    for (int n = 0; n < 9; ++n) {
      const auto found = cells_.find(KeyOf(cell + Eigen::Vector2i(n % 3 - 1, n / 3 - 1)));
      if (found == cells_.end()) continue;
      for (const std::size_t i : found->second) {
        const Eigen::Vector3d offset =
            all_[i].T_map_scan.translation() - seen.T_map_scan.translation();
        const double distance_m = offset.head<2>().norm();
        if (distance_m <= kNear_m && std::abs(offset.z()) <= kSameFloor_m) {
          near.emplace_back(distance_m, i);
        }
      }
    }
    std::ranges::sort(near);
    near.resize(std::min(near.size(), kMostOthers));
    std::vector<std::size_t> nearest;
    nearest.reserve(near.size());
    for (const auto& [distance_m, i] : near) nearest.push_back(i);
    return nearest;
  }

 private:
  static Eigen::Vector2i CellOf(const Observation& seen) {
    return (seen.T_map_scan.translation().head<2>() / kNear_m).array().floor().cast<int>();
  }
  static std::int64_t KeyOf(const Eigen::Vector2i& cell) {
    return (static_cast<std::int64_t>(cell.x()) << 32) ^ static_cast<std::uint32_t>(cell.y());
  }

  std::span<const Observation> all_;
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells_;
};

/// What of a structure stands near a point of its level frame.
Structure Near(const Structure& structure, const Eigen::Vector2d& at, double within_m) {
  Structure near = structure;
  std::erase_if(near.posts, [&](const Post& post) {
    return (Eigen::Vector2d(post.x_cm, post.y_cm) / 100.0 - at).norm() > within_m;
  });
  return near;
}

/// How well one lies on the other where their poses put it; what lies better elsewhere does not.
/// Of what both see, the near half of the reach counts: what a rebuilt street looks like from the
/// next one is no change there.
double Agreement(const Observation& seen, const Observation& other, const AutoParams& params) {
  const double within_m = kLookedAt * params.posts.reach_m;
  const Eigen::Vector2d at = (LevelFromSensor(other.structure).linear() *
                              (other.T_map_scan.inverse() * seen.T_map_scan).translation())
                                 .head<2>();
  const PairCheck check = CheckPair({0, 1, Near(other.structure, at, within_m),
                                     Near(seen.structure, Eigen::Vector2d::Zero(), within_m)},
                                    other.T_map_scan, seen.T_map_scan, params);
  const bool as_told = check.verdict == PairCheck::Verdict::kAgrees ||
                       !MissOf(DifferenceOf(check.told, check.shown), kTold).any();
  return as_told ? check.score : 0.0;
}

Comparison CompareOne(const Observation& seen, const Grid& grid,
                      std::span<const Observation> others, const AutoParams& params) {
  Comparison comparison;
  if (seen.structure.posts.size() < kMinPosts) return comparison;
  for (const std::size_t i : grid.Near(seen)) {
    const double agreement = Agreement(seen, others[i], params);
    if (comparison.other && agreement <= comparison.agreement) continue;
    comparison.other = i;
    comparison.agreement = agreement;
  }
  return comparison;
}

/// An observation and those before and after it in its visit until one lies farther off.
template <typename Visit>
void VisitNeighbours(std::span<const Observation> seen, std::size_t i, double within_m,
                     Visit&& visit) {
  const auto is_near = [&](std::size_t k) {
    return seen[k].session == seen[i].session &&
           (seen[k].T_map_scan.translation() - seen[i].T_map_scan.translation()).norm() <= within_m;
  };
  for (std::size_t k = i; k < seen.size() && is_near(k); ++k) visit(k);
  for (std::size_t k = i; k-- > 0 && is_near(k);) visit(k);
}

/// The median of what the neighbours of an observation in its visit say.
double JudgedTogether(std::span<const Observation> seen, const std::vector<Comparison>& alone,
                      std::size_t i) {
  std::vector<double> said;
  VisitNeighbours(seen, i, kTogether_m, [&](std::size_t k) {
    if (alone[k].other) said.push_back(alone[k].agreement);
  });
  return Median(std::move(said));
}

/// What a quarter of those compared reach; 0 where there are none.
double UsualAgreement(const std::vector<Comparison>& alone) {
  std::vector<double> said;
  for (const Comparison& comparison : alone) {
    if (comparison.other) said.push_back(comparison.agreement);
  }
  if (said.empty()) return 0.0;
  const auto upper = said.begin() + static_cast<std::ptrdiff_t>(said.size() * 3 / 4);
  std::nth_element(said.begin(), upper, said.end());
  return *upper;
}

double LeastAgreement(const Bounds& bounds, double usual) {
  return std::clamp(bounds.share * usual, bounds.always, bounds.never);
}

/// Tells change by the agreements that `compared` holds of neighbours together.
void TellChange(std::span<const Observation> seen, double usual,
                std::vector<Comparison>& compared) {
  const double clear = LeastAgreement(kClear, usual);
  const double beside = LeastAgreement(kBeside, usual);
  for (Comparison& comparison : compared) {
    if (comparison.other) comparison.change = Change::kSame;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!compared[i].other || compared[i].agreement >= clear) continue;
    VisitNeighbours(seen, i, kBeside_m, [&](std::size_t k) {
      if (compared[k].other && compared[k].agreement < beside)
        compared[k].change = Change::kChanged;
    });
  }
}

}  // namespace

const char* ChangeName(Change change) {
  switch (change) {
    case Change::kSame:
      return "same";
    case Change::kChanged:
      return "changed";
    case Change::kUnseen:
      return "unseen";
  }
  return "";
}

absl::StatusOr<std::vector<Comparison>> Compare(std::span<const Observation> seen,
                                                std::span<const Observation> others,
                                                const AutoParams& params, int num_threads) {
  const Grid grid(others);
  std::vector<Comparison> alone(seen.size());
  const auto compare = [&](std::size_t i, std::size_t /*worker*/) {
    alone[i] = CompareOne(seen[i], grid, others, params);
    return absl::OkStatus();
  };
  RETURN_IF_ERROR(RunJobs(NumThreads(num_threads), seen.size(), compare, [](std::size_t) {}));
  std::vector<Comparison> comparisons = alone;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (alone[i].other) comparisons[i].agreement = JudgedTogether(seen, alone, i);
  }
  TellChange(seen, UsualAgreement(alone), comparisons);
  return comparisons;
}

absl::StatusOr<std::vector<Observation>> ObserveMap(const std::string& path) {
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(path));
  if (!info.params.structure.enabled) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", path, "' holds no structures of its scans, which comparing needs; ",
                     "build it again with --keep-scans"));
  }
  ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(path));
  std::vector<Observation> places;
  places.reserve(records.size());
  const absl::Status visited = mapdb::VisitDescriptors(
      path, [&](std::size_t i, const PlaceDescriptor& descriptor) -> absl::Status {
        if (i >= records.size()) return absl::UnavailableError("the map was written meanwhile");
        const mapdb::PlaceRecord& record = records[i];
        places.push_back({record.scan,
                          info.sessions[static_cast<std::size_t>(record.place.session)].name,
                          record.place.T_map_place, descriptor.structure});
        return absl::OkStatus();
      });
  if (!visited.ok()) return visited;
  return places;
}

absl::StatusOr<std::vector<Observation>> ObserveDrive(const Params& params,
                                                      const mapdb::SessionPlan& plan,
                                                      const mapdb::ScanLoader& load_scan,
                                                      const DriveOptions& options,
                                                      std::vector<std::size_t>& scans) {
  RETURN_IF_ERROR(Validate(options));
  RETURN_IF_ERROR(mapdb::Validate(plan));
  ASSIGN_OR_RETURN(DescribedDrive drive, DescribeDrive(params, plan, load_scan, options));
  std::vector<Observation> seen;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const mapdb::PlannedScan& scan = plan.scans[drive.scans[k]];
    seen.push_back({scan.name, "", scan.T_map_place, std::move(drive.descriptors[k].structure)});
  }
  scans = std::move(drive.scans);
  return seen;
}

}  // namespace scanloc::slam
