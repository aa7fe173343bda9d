#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/history.hpp"
#include "scanloc/mapdb/map_builder.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"

/// New maps made of places of others: what merge, edit and refresh share.
namespace scanloc::mapdb {

/// What a map is to be made of.
struct CopySource {
  std::string path;
  FileInfo info;
};
/// FailedPrecondition: it is incomplete. Else the errors of map_file.hpp.
[[nodiscard]] absl::StatusOr<CopySource> ReadSource(const std::string& path);

/// A place of a source as the new map is to have it.
struct CopiedPlace {
  std::int64_t place = 0;  ///< in its source
  std::string session;     ///< neighbours of one name become one session
  PlannedScan scan;
};
/// All of a source, as they are. Unavailable: it was written since it was read. Else the errors of
/// map_file.hpp.
[[nodiscard]] absl::StatusOr<std::vector<CopiedPlace>> AllPlaces(const CopySource& source);

/// Some places of one source, ascending.
struct CopyPart {
  const CopySource* source = nullptr;
  /// Asked once, when they are written: only those of one part are in memory at a time.
  std::function<absl::StatusOr<std::vector<CopiedPlace>>()> places;
};
/// A part of these.
[[nodiscard]] CopyPart PartOf(const CopySource& source, std::vector<CopiedPlace> places);

/// Writes a new map of all parts, in their order, and gives its content id. Its history is that of
/// the sources and made_by, with their content ids as parents, unless made_by has no command.
///
/// The file appears under its name in one step, finished, whole and on disk, and only if there is
/// none of that name: AlreadyExists. What a killed process leaves is named `OUT.partial-PID`, and
/// removed by who writes OUT an hour later.
/// FailedPrecondition: sources of other parameters. InvalidArgument: no place at all.
[[nodiscard]] absl::StatusOr<std::string> WriteCopy(const std::string& out,
                                                    const std::vector<CopyPart>& parts,
                                                    HistoryEntry made_by, const Finish& finish);

/// The name, or the first of NAME-2, NAME-3, ... that is not taken.
[[nodiscard]] std::string FreeName(const std::string& name, const std::set<std::string>& taken);

/// AlreadyExists if there is a file of that name.
[[nodiscard]] absl::Status CheckIsNew(const std::string& path);

}  // namespace scanloc::mapdb
