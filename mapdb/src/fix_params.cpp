#include "scanloc/mapdb/fix_params.hpp"

#include <algorithm>

#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/learn_scale.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {
namespace {

absl::Status FixToAppend(bool resume, const SessionPlan& plan, BuildOptions& options) {
  if (resume) {
    RETURN_IF_ERROR(RecoverMap(options.path).status());
  }
  ASSIGN_OR_RETURN(const FileInfo info, ReadInfo(options.path));
  options.params = info.params;
  // A build stopped before its session was first committed has left nothing to resume.
  const bool begun = std::ranges::any_of(
      info.sessions, [&](const SessionInfo& existing) { return existing.name == plan.name; });
  if (resume && begun) options.mode = BuildMode::kResume;
  return absl::OkStatus();
}

}  // namespace

absl::Status FixParams(const FixOptions& how, const SessionPlan& plan, const ScanLoader& load_scan,
                       BuildOptions& options) {
  if (options.mode == BuildMode::kAppend) return FixToAppend(how.resume, plan, options);
  if (how.resume) options.mode = BuildMode::kResume;
  if (!how.learn_scale || !options.params.structure.enabled) return absl::OkStatus();
  // What is wrong with the file is told by the build.
  if (how.resume && RecoverMap(options.path).ok()) {
    if (const absl::StatusOr<FileInfo> begun = ReadInfo(options.path); begun.ok()) {
      options.params.automatic = begun->params.automatic;
      return absl::OkStatus();
    }
  }
  ASSIGN_OR_RETURN(const double scale, LearnScale(options.params, plan, load_scan));
  options.params.automatic = AutoParamsAtScale(scale);
  return absl::OkStatus();
}

}  // namespace scanloc::mapdb
