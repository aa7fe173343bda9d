#include "scanloc/mapdb/merge_maps.hpp"

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "copy_places.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::mapdb {
namespace {

/// Names the sessions of an input so that they can stand beside those taken.
absl::Status NameSessions(bool rename_sessions, std::set<std::string>& taken, CopySource& source) {
  for (SessionInfo& session : source.info.sessions) {
    std::string name = rename_sessions ? FreeName(session.name, taken) : session.name;
    if (!taken.insert(name).second) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", source.path, "' has a session '", session.name,
                       "', and an earlier map, too; merge them with --rename-sessions"));
    }
    session.name = std::move(name);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> MergeMaps(const std::string& out,
                                      const std::vector<std::string>& inputs, bool rename_sessions,
                                      HistoryEntry made_by, const Finish& finish) {
  if (inputs.empty()) return absl::InvalidArgumentError("there is no map to merge; name some");
  std::vector<CopySource> sources;
  sources.reserve(inputs.size());
  for (const std::string& path : inputs) {
    ASSIGN_OR_RETURN(CopySource source, ReadSource(path));
    sources.push_back(std::move(source));
  }
  std::set<std::string> taken;
  std::vector<CopyPart> parts;
  for (CopySource& source : sources) {
    RETURN_IF_ERROR(NameSessions(rename_sessions, taken, source));
    parts.push_back({&source, [&source] { return AllPlaces(source); }});
  }
  return WriteCopy(out, parts, std::move(made_by), finish);
}

}  // namespace scanloc::mapdb
