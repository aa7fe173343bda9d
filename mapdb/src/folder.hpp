#pragma once

#include <string>

#include "absl/status/status.h"

/// Changes to a folder that hold through a power cut.
namespace scanloc::mapdb {

/// Makes durable which files are in the folder of `path`.
[[nodiscard]] absl::Status SyncFolderOf(const std::string& path);
/// Renames a file, over another if there is one.
[[nodiscard]] absl::Status RenameFile(const std::string& from, const std::string& to);
/// Renames a file unless there is one of that name: AlreadyExists.
[[nodiscard]] absl::Status RenameNew(const std::string& from, const std::string& to);
[[nodiscard]] absl::Status RemoveFile(const std::string& path);
/// Removes the files whose path is that begin and the number of another process, and which nobody
/// has locked, or written to for an hour: what was left by processes that were killed.
void RemoveLeftBehind(const std::string& begin);

}  // namespace scanloc::mapdb
