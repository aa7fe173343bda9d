#include "open_map.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "folder.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr int kBusyTimeout_ms = 5000;
constexpr std::size_t kFrontBytes = 100;
constexpr std::string_view kMagic("SQLite format 3\0", 16);
constexpr std::size_t kWriteVersionOffset = 18;
constexpr std::size_t kReadVersionOffset = 19;
constexpr std::size_t kApplicationIdOffset = 68;

// A file switched to a write-ahead log is no longer one file, and reading it would make others.
absl::Status CheckJournalMode(Connection& connection) {
  ASSIGN_OR_RETURN(const std::string front, connection.ReadFront(kFrontBytes));
  if (front.size() < kFrontBytes || !front.starts_with(kMagic)) return absl::OkStatus();
  if (front[kWriteVersionOffset] != 1 || front[kReadVersionOffset] != 1) {
    return DamagedError(connection.path(),
                        "it is not in rollback-journal mode, in which scanloc writes maps");
  }
  return absl::OkStatus();
}

// The first read takes the lock, and finds out whether a dead process left an unfinished write.
absl::Status StartReading(Connection& connection) {
  for (const char* sql : {schema::kConfigureReader, schema::kBeginRead}) {
    RETURN_IF_ERROR(connection.Execute(sql));
  }
  return connection.QueryInt(schema::kCountPages).status();
}

// Of what could not be opened: without rights to it, or with no descriptor left.
bool MayBeJournal(const std::string& journal) {
  using std::filesystem::file_type;
  std::error_code error;
  const file_type type = std::filesystem::symlink_status(journal, error).type();
  return type == file_type::regular || type == file_type::not_found || type == file_type::none;
}

// What lies in the way of a reader or writer, beside the map.
absl::Status JournalError(const std::string& path) {
  const std::string journal = JournalOf(path);
  const std::string beside = absl::StrCat("beside map '", path, "' lies '", journal, "', ");
  switch (LookAtJournal(journal)) {
    case JournalState::kNone:  // it could not be looked at a moment ago
    case JournalState::kNoFile:
      if (MayBeJournal(journal)) {  // and then the map needs it
        return absl::UnavailableError(
            absl::StrCat("cannot look at the journal of map '", path, "', '", journal,
                         "': check the rights to it and its folder, and the limit of open files"));
      }
      return absl::FailedPreconditionError(absl::StrCat(
          beside, "which is no file that can be read; no build makes such: remove it"));
    case JournalState::kNamesAnother:
      return absl::FailedPreconditionError(absl::StrCat(
          beside, "which would have another file deleted; no build makes such: remove it"));
    default:
      return absl::FailedPreconditionError(absl::StrCat(
          beside, "the unfinished write of a build that was killed. If it is this map's, complete ",
          "the build with --resume, or undo the write with scanloc verify --recover; if the map ",
          "was put here in the place of that build's, remove the journal"));
  }
}

}  // namespace

absl::StatusOr<Connection> OpenConnection(const std::string& path, Access access) {
  RETURN_IF_ERROR(CheckIsFile(path));
  const JournalState journal = LookAtJournal(JournalOf(path));
  if (journal == JournalState::kNoFile || journal == JournalState::kNamesAnother) {
    return JournalError(path);
  }
  ASSIGN_OR_RETURN(Connection connection, Connection::Open(path, access, kBusyTimeout_ms));
  RETURN_IF_ERROR(CheckJournalMode(connection));
  return connection;
}

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
  ASSIGN_OR_RETURN(const std::string front, connection.ReadFront(kFrontBytes));
  const std::string& path = connection.path();
  if (front.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("map '", path,
                     "' is empty: its build was stopped before the first commit, or it is no map;",
                     " build it again with --resume"));
  }
  if (front.size() < kFrontBytes || !front.starts_with(kMagic)) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", path, "' is not a scanloc map: it is not an SQLite file"));
  }
  std::uint32_t application_id = 0;
  for (const char byte : front.substr(kApplicationIdOffset, 4)) {
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

absl::StatusOr<Connection> OpenForReading(const std::string& path) {
  // A build that ends just now may leave the look of one that was killed, for a moment.
  constexpr int kTries = 3;
  for (int i = 0; i < kTries; ++i) {
    ASSIGN_OR_RETURN(Connection connection, OpenConnection(path, Access::kRead));
    absl::Status status = StartReading(connection);
    if (!status.ok() && connection.needs_rollback()) continue;
    if (status.ok()) status = CheckFront(connection);
    if (!status.ok()) return status;
    return connection;
  }
  return JournalError(path);
}

absl::StatusOr<Connection> OpenForWriting(const std::string& path, Access access) {
  ASSIGN_OR_RETURN(Connection connection, OpenConnection(path, access));
  if (connection.is_read_only()) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot write map '", path, "'; check the rights to the file"));
  }
  absl::Status status = connection.Execute(schema::kConfigureWriter);
  if (status.ok()) return connection;
  const JournalState journal = LookAtJournal(JournalOf(path));
  const bool is_refused = access == Access::kWrite && journal == JournalState::kHot;
  return absl::IsPermissionDenied(status) && is_refused ? JournalError(path) : status;
}

absl::Status CreateEmptyFile(const std::string& path) {
  struct stat unused = {};
  if (lstat(JournalOf(path).c_str(), &unused) != 0 && errno == ENAMETOOLONG) {
    return absl::InvalidArgumentError(absl::StrCat("cannot create map '", path, "': its name or ",
                                                   "that of its journal, which is longer by 8 ",
                                                   "bytes, is too long; choose a shorter one"));
  }
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file >= 0) {
    close(file);
    return SyncFolderOf(path);
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
