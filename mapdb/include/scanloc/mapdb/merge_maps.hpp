#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/mapdb/history.hpp"

namespace scanloc::mapdb {

/// What is still to be done to a new map, at this path, before it gets its name: calibrate it.
/// Where it fails there is no new map, and its error is given.
using Finish = std::function<absl::Status(const std::string& path)>;

/// Writes a new map that holds the sessions of all inputs, in their order, and gives its content
/// id.
///
/// Sessions without a place are left out. Where two have one name it is refused, or, with
/// rename_sessions, the later gets the first free of NAME-2, NAME-3, ... AlreadyExists if there is
/// a file at `out`; FailedPrecondition if an input is incomplete, parameters differ (names the
/// first difference), two sessions have one name or two inputs another geo origin; InvalidArgument
/// without an input or a place; else the errors of map_file.hpp and MapBuilder, naming the input.
/// The file appears whole and on disk, or not at all. The history of the inputs and made_by, if it
/// has a command, become its own.
[[nodiscard]] absl::StatusOr<std::string> MergeMaps(const std::string& out,
                                                    const std::vector<std::string>& inputs,
                                                    bool rename_sessions = false,
                                                    HistoryEntry made_by = {},
                                                    const Finish& finish = {});

}  // namespace scanloc::mapdb
