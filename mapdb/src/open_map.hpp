#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/mapdb/map_file.hpp"
#include "sqlite.hpp"

/// Opening map files, and refusing what is none.
namespace scanloc::mapdb {

/// OK if there is a regular file; NotFound, InvalidArgument.
[[nodiscard]] absl::Status CheckIsFile(const std::string& path);

/// Refuses what is no scanloc map by the first bytes of the file.
[[nodiscard]] absl::Status CheckFront(Connection& connection);

/// Opens a map for reading in one transaction, so that all statements see the same commit. The
/// errors of map_file.hpp.
[[nodiscard]] absl::StatusOr<Connection> OpenForReading(
    const std::string& path, UnfinishedWrite unfinished = UnfinishedWrite::kRollBack);

/// Creates an empty file, and fails if there is one: nobody's file is written over, whatever the
/// timing. AlreadyExists; NotFound if its folder does not exist; PermissionDenied,
/// ResourceExhausted.
[[nodiscard]] absl::Status CreateEmptyFile(const std::string& path);

/// Opens an existing file for writing, without looking into it yet and outside any transaction.
[[nodiscard]] absl::StatusOr<Connection> OpenForWriting(const std::string& path);

}  // namespace scanloc::mapdb
