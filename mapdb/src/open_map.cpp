#include "open_map.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr int kReaderBusyTimeout_ms = 5000;
constexpr std::size_t kFrontBytes = 100;
constexpr std::string_view kMagic("SQLite format 3\0", 16);
constexpr std::size_t kWriteVersionOffset = 18;
constexpr std::size_t kReadVersionOffset = 19;
constexpr std::size_t kApplicationIdOffset = 68;

// A file switched to a write-ahead log is no longer one file, and reading it would make others.
absl::Status CheckJournalMode(Connection& connection) {
  const absl::StatusOr<std::string> front = connection.ReadFront(kFrontBytes);
  if (!front.ok()) return front.status();
  if (front->size() < kFrontBytes || !front->starts_with(kMagic)) return absl::OkStatus();
  if ((*front)[kWriteVersionOffset] != 1 || (*front)[kReadVersionOffset] != 1) {
    return DamagedError(connection.path(),
                        "it is not in rollback-journal mode, in which scanloc writes maps");
  }
  return absl::OkStatus();
}

absl::StatusOr<Connection> OpenConnection(const std::string& path, Connection::Access access) {
  absl::StatusOr<Connection> connection = Connection::Open(path, access, kReaderBusyTimeout_ms);
  if (!connection.ok()) return connection.status();
  if (absl::Status status = CheckJournalMode(*connection); !status.ok()) return status;
  return connection;
}

// The first read takes the lock, and finds out whether a dead process left an unfinished write.
absl::Status StartReading(Connection& connection) {
  for (const char* sql : {schema::kConfigureReader, schema::kBeginRead}) {
    if (absl::Status status = connection.Execute(sql); !status.ok()) return status;
  }
  return connection.QueryInt(schema::kCountPages).status();
}

absl::Status UnfinishedWriteError(const std::string& path) {
  return absl::FailedPreconditionError(absl::StrCat(
      "beside map '", path, "' lies '", path,
      "-journal', the unfinished write of a build that was ",
      "killed. If the map was put here in the place of that build's, remove the journal: undoing ",
      "it would damage the map. If it is that build's own, undo the write with scanloc verify, or ",
      "complete the build with --resume"));
}

absl::Status RollBackDeadWrite(const std::string& path) {
  absl::StatusOr<Connection> connection = OpenConnection(path, Connection::Access::kReadWrite);
  absl::Status status = connection.status();
  if (status.ok()) status = StartReading(*connection);
  if (status.ok() || absl::IsUnavailable(status)) return status;
  return absl::FailedPreconditionError(absl::StrCat(
      "map '", path, "' holds the unfinished write of a build that was killed, and it cannot be",
      " undone here (", status.message(),
      "); open the map once where file and folder may be written, for example with scanloc "
      "verify"));
}

}  // namespace

absl::Status CheckIsFile(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status file = std::filesystem::status(path, error);
  if (file.type() == std::filesystem::file_type::not_found) {
    return absl::NotFoundError(absl::StrCat("there is no map file '", path, "'; check the path"));
  }
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot open map '", path, "': ", error.message()));
  }
  if (file.type() != std::filesystem::file_type::regular) {
    const bool is_folder = file.type() == std::filesystem::file_type::directory;
    return absl::InvalidArgumentError(absl::StrCat(
        "'", path, "' is ", is_folder ? "a folder" : "not a file", "; a map is one file"));
  }
  return absl::OkStatus();
}

absl::Status CheckFront(Connection& connection) {
  const absl::StatusOr<std::string> front = connection.ReadFront(kFrontBytes);
  if (!front.ok()) return front.status();
  const std::string& path = connection.path();
  if (front->empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("map '", path,
                     "' is empty: its build was stopped before the first commit, or it is no map;",
                     " build it again with --resume"));
  }
  if (front->size() < kFrontBytes || !front->starts_with(kMagic)) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", path, "' is not a scanloc map: it is not an SQLite file"));
  }
  std::uint32_t application_id = 0;
  for (const char byte : front->substr(kApplicationIdOffset, 4)) {
    application_id = application_id << 8 | static_cast<std::uint8_t>(byte);
  }
  if (application_id != schema::kApplicationId) {
    return absl::InvalidArgumentError(absl::StrCat(
        "'", path,
        "' is not a scanloc map: it is the SQLite database of another application (id 0x",
        absl::Hex(application_id, absl::kZeroPad8), ")"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Connection> OpenForReading(const std::string& path, UnfinishedWrite unfinished) {
  if (absl::Status status = CheckIsFile(path); !status.ok()) return status;
  absl::StatusOr<Connection> connection = OpenConnection(path, Connection::Access::kReadOnly);
  if (!connection.ok()) return connection.status();
  absl::Status status = StartReading(*connection);
  if (!status.ok() && connection->needs_rollback()) {
    if (unfinished == UnfinishedWrite::kRefuse) return UnfinishedWriteError(path);
    if (status = RollBackDeadWrite(path); !status.ok()) return status;
    connection = OpenConnection(path, Connection::Access::kReadOnly);
    if (!connection.ok()) return connection.status();
    status = StartReading(*connection);
  }
  if (status.ok()) status = CheckFront(*connection);
  if (!status.ok()) return status;
  return connection;
}

absl::StatusOr<Connection> OpenForWriting(const std::string& path) {
  if (absl::Status status = CheckIsFile(path); !status.ok()) return status;
  absl::StatusOr<Connection> connection = OpenConnection(path, Connection::Access::kReadWrite);
  if (!connection.ok()) return connection.status();
  if (connection->is_read_only()) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot write map '", path, "'; check the rights to the file"));
  }
  if (absl::Status status = connection->Execute(schema::kConfigureWriter); !status.ok()) {
    return status;
  }
  return connection;
}

absl::Status CreateEmptyFile(const std::string& path) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file >= 0) {
    close(file);
    return absl::OkStatus();
  }
  const int error = errno;
  const std::string message =
      absl::StrCat("cannot create map '", path, "': ", std::strerror(error));
  switch (error) {
    case EEXIST:
      return absl::AlreadyExistsError(absl::StrCat("there is a file '", path,
                                                   "' already; remove it, choose another name, or",
                                                   " build with --append or --resume"));
    case ENOENT:
    case ENOTDIR:
      return absl::NotFoundError(absl::StrCat(message, "; make its folder first"));
    case ENOSPC:
    case EDQUOT:
      return absl::ResourceExhaustedError(absl::StrCat(message, "; make room first"));
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::PermissionDeniedError(absl::StrCat(message, "; check the rights to its folder"));
    default:
      return absl::InvalidArgumentError(message);
  }
}

}  // namespace scanloc::mapdb
