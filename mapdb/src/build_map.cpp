#include "scanloc/mapdb/build_map.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/jobs/ordered_jobs.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kWindowPerThread = 4;

// What became of one scan.
struct DescribedScan {
  absl::Status load_status;
  PlaceDescriptor descriptor;
  ScanCounts counts;
};

absl::StatusOr<MapBuilder> OpenBuilder(const BuildOptions& options, const SessionPlan& plan) {
  switch (options.mode) {
    case BuildMode::kCreate:
      return MapBuilder::Create(options.path, options.params, plan);
    case BuildMode::kAppend:
      return MapBuilder::Append(options.path, plan);
    case BuildMode::kResume:
      return MapBuilder::Resume(options.path, options.params, plan);
  }
  return absl::InvalidArgumentError("unknown build mode");
}

absl::Status NameScan(const absl::Status& status, const SessionPlan& plan, std::size_t scan) {
  return {status.code(), absl::StrCat("scan ", scan + 1, " of ", plan.scans.size(), " ('",
                                      plan.scans[scan].name, "'): ", status.message())};
}

// Writes one scan into the map, or counts why not.
absl::Status WriteScan(const DescribedScan& scan, bool skip_unreadable, MapBuilder& builder,
                       BuildSummary& summary) {
  if (!scan.load_status.ok()) {
    absl::Status named = NameScan(scan.load_status, builder.plan(), builder.next_scan());
    if (!skip_unreadable || absl::IsCancelled(scan.load_status)) return named;
    if (summary.num_unreadable++ == 0) summary.first_unreadable = absl::StrCat(named.message());
    return builder.Skip(SkipReason::kUnreadable);
  }
  summary.num_points += static_cast<std::int64_t>(scan.counts.num_points);
  summary.num_points_not_finite += static_cast<std::int64_t>(scan.counts.num_not_finite);
  if (scan.descriptor.num_voxels == 0) {
    ++summary.num_empty;
    return builder.Skip(SkipReason::kEmpty);
  }
  ++summary.num_places;
  return builder.Add(scan.descriptor);
}

absl::Status BuildAll(const BuildOptions& options, const ScanLoader& load_scan,
                      const ProgressCallback& progress, MapBuilder& builder,
                      BuildSummary& summary) {
  const std::size_t num_scans = builder.plan().scans.size();
  const std::size_t num_left = num_scans - builder.next_scan();
  if (num_left == 0) return absl::OkStatus();
  const std::size_t num_threads =
      std::min({NumThreads(options.num_threads), num_left, std::size_t{kMaxThreads}});
  absl::StatusOr<std::vector<Describer>> describers = MakeDescribers(builder.params(), num_threads);
  if (!describers.ok()) return describers.status();
  OrderedJobs<DescribedScan> scans(builder.next_scan(), num_scans, kWindowPerThread * num_threads,
                                   [&](std::size_t scan, std::size_t worker) {
                                     DescribedScan described;
                                     const absl::StatusOr<PointCloud> points = load_scan(scan);
                                     described.load_status = points.status();
                                     if (points.ok()) {
                                       described.descriptor = (*describers)[worker].DescribePlace(
                                           *points, &described.counts);
                                     }
                                     return described;
                                   });
  if (absl::Status status = scans.Start(num_threads); !status.ok()) return status;

  for (int num_uncommitted = 1; builder.next_scan() < num_scans; ++num_uncommitted) {
    absl::Status status = WriteScan(scans.Take(), options.skip_unreadable, builder, summary);
    if (status.ok() && num_uncommitted % options.commit_interval == 0) status = builder.Commit();
    if (!status.ok()) return status;
    if (progress) progress({builder.next_scan(), num_scans});
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const BuildOptions& options) {
  if (options.path.empty()) return absl::InvalidArgumentError("path is empty; name the map file");
  if (options.num_threads < 0 || options.num_threads > kMaxThreads) {
    return absl::InvalidArgumentError(absl::StrCat("num_threads is ", options.num_threads,
                                                   "; it must be in [0, ", kMaxThreads, "]"));
  }
  if (options.commit_interval < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("commit_interval is ", options.commit_interval, "; it must be at least 1"));
  }
  return options.mode == BuildMode::kAppend ? absl::OkStatus() : scanloc::Validate(options.params);
}

absl::StatusOr<BuildSummary> BuildMap(const BuildOptions& options, const SessionPlan& plan,
                                      const ScanLoader& load_scan,
                                      const ProgressCallback& progress) {
  if (absl::Status status = Validate(options); !status.ok()) return status;
  absl::StatusOr<MapBuilder> builder = OpenBuilder(options, plan);
  if (!builder.ok()) return builder.status();
  BuildSummary summary;
  if (absl::Status status = BuildAll(options, load_scan, progress, *builder, summary);
      !status.ok()) {
    const absl::Status committed = builder->Commit();
    return committed.ok() ? status : committed;
  }
  absl::StatusOr<std::string> content_id = builder->Finish();
  if (!content_id.ok()) return content_id.status();
  summary.content_id = *std::move(content_id);
  summary.num_places_in_map = builder->num_places();
  return summary;
}

}  // namespace scanloc::mapdb
