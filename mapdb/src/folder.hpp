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

}  // namespace scanloc::mapdb
