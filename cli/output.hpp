#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace scanloc::cli {

/// Keeps files that are opened later off the numbers of standard streams that the caller closed,
/// and makes a closed pipe, or a file as long as files may be, an error of the write instead of a
/// signal. Call first in main.
void PrepareStandardStreams();

/// Writes all of the text to the path, or to stdout if it is "-".
///
/// A regular file appears under its name only once all of it is on disk, in place of one that was
/// there before and held text; until then it is left as it was. Devices and pipes are written
/// directly. AlreadyExists: a map, a scan or the like is there. ResourceExhausted: the disk is
/// full. Unavailable: the reader closed the pipe. NotFound, PermissionDenied, InvalidArgument (a
/// folder) and the like, naming the path.
[[nodiscard]] absl::Status WriteText(const std::string& path, std::string_view text);

/// Writes files, each name and text, into a folder that is made if need be. PermissionDenied: it
/// cannot be made.
[[nodiscard]] absl::Status WriteReport(
    const std::string& folder, const std::vector<std::pair<std::string, std::string>>& files);

/// Makes NAME.pdf beside every NAME.svg of the files (WriteReport) in the folder by rsvg-convert,
/// each whole or not at all. Where there is no such program a note on standard error says so.
/// Internal: it failed, and said why on standard error.
[[nodiscard]] absl::Status MakePdfs(const std::string& folder,
                                    const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace scanloc::cli
