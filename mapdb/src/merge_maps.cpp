#include "scanloc/mapdb/merge_maps.hpp"

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "copy_places.hpp"

namespace scanloc::mapdb {
namespace {

/// The places of an input, their sessions named so that they can stand beside those taken.
absl::StatusOr<CopyPart> PartOf(const CopySource& source, bool rename_sessions,
                                std::set<std::string>& taken) {
  std::vector<std::string> names;
  for (const SessionInfo& session : source.info.sessions) {
    const std::string name = rename_sessions ? FreeName(session.name, taken) : session.name;
    if (!taken.insert(name).second) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", source.path, "' has a session '", session.name,
                       "', and an earlier map, too; merge them with --rename-sessions"));
    }
    names.push_back(name);
  }
  CopyPart part{&source, AllPlaces(source)};
  for (CopiedPlace& copied : part.places) {
    const PlaceRecord& record = source.places[static_cast<std::size_t>(copied.place)];
    copied.session = names[static_cast<std::size_t>(record.place.session)];
  }
  return part;
}

}  // namespace

absl::StatusOr<std::string> MergeMaps(const std::string& out,
                                      const std::vector<std::string>& inputs, bool rename_sessions,
                                      HistoryEntry made_by, const Finish& finish) {
  if (inputs.empty()) return absl::InvalidArgumentError("there is no map to merge; name some");
  std::vector<CopySource> sources;
  sources.reserve(inputs.size());
  for (const std::string& path : inputs) {
    absl::StatusOr<CopySource> source = ReadSource(path);
    if (!source.ok()) return source.status();
    sources.push_back(*std::move(source));
  }
  std::set<std::string> taken;
  std::vector<CopyPart> parts;
  for (const CopySource& source : sources) {
    absl::StatusOr<CopyPart> part = PartOf(source, rename_sessions, taken);
    if (!part.ok()) return part.status();
    parts.push_back(*std::move(part));
  }
  return WriteCopy(out, parts, std::move(made_by), finish);
}

}  // namespace scanloc::mapdb
