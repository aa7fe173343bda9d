#include "scanloc/mapdb/build_map.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/ordered_jobs.hpp"
#include "scanloc/mapdb/map_file.hpp"

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

DescribedScan LoadAndDescribe(const ScanLoader& load_scan, std::size_t scan, Describer& describer) {
  DescribedScan described;
  const absl::StatusOr<PointCloud> points = load_scan(scan);
  described.load_status = points.status();
  if (points.ok()) described.descriptor = describer.DescribePlace(*points, &described.counts);
  return described;
}

// The scans up to the first that makes a place or stops the build, so that of a drive that shows
// nothing nothing is written.
absl::StatusOr<std::vector<DescribedScan>> DescribeToFirstPlace(const BuildOptions& options,
                                                                const SessionPlan& plan,
                                                                const ScanLoader& load_scan) {
  Params params = options.params;
  if (options.mode == BuildMode::kAppend) {
    ASSIGN_OR_RETURN(const FileInfo map, ReadInfo(options.path));
    params = map.params;
  }
  ASSIGN_OR_RETURN(Describer describer, Describer::Create(params));
  std::vector<DescribedScan> described;
  std::size_t num_points = 0, num_not_finite = 0, num_unreadable = 0;
  absl::Status first_unreadable;
  for (std::size_t scan = 0; scan < plan.scans.size(); ++scan) {
    DescribedScan next = LoadAndDescribe(load_scan, scan, describer);
    if (!next.load_status.ok()) {
      absl::Status named = NameScan(next.load_status, plan, scan);
      if (!options.skip_unreadable || absl::IsCancelled(next.load_status)) return named;
      if (num_unreadable++ == 0) first_unreadable = std::move(named);
    }
    num_points += next.counts.num_points;
    num_not_finite += next.counts.num_not_finite;
    const bool is_place = next.descriptor.num_voxels > 0;
    if (!is_place) next.descriptor = {};  // there may be many of them
    described.push_back(std::move(next));
    if (is_place) return described;
  }
  std::string seen =
      absl::StrCat("none of the ", plan.scans.size(), " scans of session '", plan.name,
                   "' makes a place: ", plan.scans.size() - num_unreadable,
                   " have no point in range, of ", num_points, " points in all");
  if (num_not_finite > 0) absl::StrAppend(&seen, ", ", num_not_finite, " of them not finite");
  if (num_unreadable > 0) {
    absl::StrAppend(&seen, ", ", num_unreadable, " cannot be read; ", first_unreadable.message());
  }
  return absl::InvalidArgumentError(absl::StrCat(seen, ". Nothing was written"));
}

// Those described already come first.
absl::Status BuildAll(const BuildOptions& options, const ScanLoader& load_scan,
                      const ProgressCallback& progress, const std::vector<DescribedScan>& already,
                      MapBuilder& builder, BuildSummary& summary) {
  const std::size_t num_scans = builder.plan().scans.size();
  const std::size_t first = builder.next_scan() + already.size();
  int num_uncommitted = 0;
  const auto write = [&](const DescribedScan& scan) {
    absl::Status status = WriteScan(scan, options.skip_unreadable, builder, summary);
    if (status.ok() && ++num_uncommitted % options.commit_interval == 0) status = builder.Commit();
    if (status.ok() && progress) progress({builder.next_scan(), num_scans});
    return status;
  };
  for (const DescribedScan& scan : already) {
    RETURN_IF_ERROR(write(scan));
  }
  if (first == num_scans) return absl::OkStatus();
  const std::size_t num_threads =
      std::min({NumThreads(options.num_threads), num_scans - first, std::size_t{kMaxThreads}});
  ASSIGN_OR_RETURN(std::vector<Describer> describers,
                   MakeDescribers(builder.params(), num_threads));
  OrderedJobs<DescribedScan> scans(first, num_scans, kWindowPerThread * num_threads,
                                   [&](std::size_t scan, std::size_t worker) {
                                     return LoadAndDescribe(load_scan, scan, describers[worker]);
                                   });
  RETURN_IF_ERROR(scans.Start(num_threads));
  while (builder.next_scan() < num_scans) {
    RETURN_IF_ERROR(write(scans.Take()));
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
  RETURN_IF_ERROR(Validate(options));
  RETURN_IF_ERROR(Validate(plan));
  std::vector<DescribedScan> already;
  std::error_code no_error;
  if (options.mode != BuildMode::kResume || !std::filesystem::exists(options.path, no_error)) {
    ASSIGN_OR_RETURN(already, DescribeToFirstPlace(options, plan, load_scan));
  }
  ASSIGN_OR_RETURN(MapBuilder builder, OpenBuilder(options, plan));
  BuildSummary summary;
  if (absl::Status status = BuildAll(options, load_scan, progress, already, builder, summary);
      !status.ok()) {
    const absl::Status committed = builder.Commit();
    return committed.ok() ? status : committed;
  }
  ASSIGN_OR_RETURN(summary.content_id, builder.Finish());
  summary.num_places_in_map = builder.num_places();
  return summary;
}

}  // namespace scanloc::mapdb
