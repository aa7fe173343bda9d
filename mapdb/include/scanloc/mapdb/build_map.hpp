#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/mapdb/map_builder.hpp"

namespace scanloc::mapdb {

enum class BuildMode {
  kCreate,  ///< MapBuilder::Create
  kAppend,  ///< MapBuilder::Append
  kResume,  ///< MapBuilder::Resume
};

struct BuildOptions {
  std::string path;
  BuildMode mode = BuildMode::kCreate;
  Params params;                 ///< kAppend: not used, those of the map are
  int num_threads = 0;           ///< that read and describe scans, at most 256; 0: one a processor
  int commit_interval = 100;     ///< scans lost at most when the build is killed, at least 1
  bool skip_unreadable = false;  ///< count scans that cannot be read instead of stopping
};

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const BuildOptions& options);

struct BuildProgress {
  std::size_t num_done = 0;   ///< scans of the plan, those of an earlier, resumed build included
  std::size_t num_scans = 0;  ///< in the plan
};

/// What a build did. The counts are those of this run, without what a resumed build did before.
struct BuildSummary {
  std::string content_id;
  std::int64_t num_places_in_map = 0;  ///< all sessions and runs
  std::int64_t num_places = 0;
  std::int64_t num_empty = 0;       ///< scans without a point in range: no place
  std::int64_t num_unreadable = 0;  ///< with skip_unreadable
  std::int64_t num_points = 0;      ///< given
  std::int64_t num_points_not_finite = 0;
  std::string first_unreadable;  ///< the first such scan and why
};

/// Reads scan i of the plan. Called from several threads at once, each scan at most once; must not
/// throw. Cancelled stops the build even where unreadable scans are skipped.
using ScanLoader = std::function<absl::StatusOr<PointCloud>(std::size_t scan)>;
/// Called from the thread that called BuildMap, after each scan; may be null.
using ProgressCallback = std::function<void(const BuildProgress&)>;

/// Builds one session of a map: reads and describes scans on several threads, writes them in order.
///
/// The map is the same for any number of threads and however often the build was killed and
/// resumed. Holds a few scans per thread in memory. The first scan, in the order of the plan, that
/// cannot be read stops the build with its status and name; all before it is committed, from the
/// first place on. Of a session without any nothing is written: InvalidArgument, with what was seen
/// of its scans.
/// Other errors are those of MapBuilder.
[[nodiscard]] absl::StatusOr<BuildSummary> BuildMap(const BuildOptions& options,
                                                    const SessionPlan& plan,
                                                    const ScanLoader& load_scan,
                                                    const ProgressCallback& progress = nullptr);

}  // namespace scanloc::mapdb
