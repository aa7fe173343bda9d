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

/// Opens a file without looking into it: no map that is not one regular file in rollback-journal
/// mode, and none beside which lies a journal that no build makes.
[[nodiscard]] absl::StatusOr<Connection> OpenConnection(const std::string& path, Access access);

/// Opens a map for reading in one transaction, so that all statements see the same commit. The
/// errors of map_file.hpp.
[[nodiscard]] absl::StatusOr<Connection> OpenForReading(const std::string& path);

/// Creates an empty file, and fails if there is one: nobody's file is written over, whatever the
/// timing. AlreadyExists; NotFound if its folder does not exist; PermissionDenied,
/// ResourceExhausted.
[[nodiscard]] absl::Status CreateEmptyFile(const std::string& path);

/// Opens an existing file for writing, without looking into it yet and outside any transaction.
/// With Access::kRecover, the unfinished write of a killed build is undone by that.
[[nodiscard]] absl::StatusOr<Connection> OpenForWriting(const std::string& path, Access access);

}  // namespace scanloc::mapdb
