#include <string>
#include <vector>

#include "file_layer.hpp"
#include "find_problems.hpp"
#include "folder.hpp"
#include "open_map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {
namespace {

// A build that was killed in its first commit leaves a file with or without a front.
absl::Status CheckMayBeMap(Connection& connection) {
  ASSIGN_OR_RETURN(const std::string front, connection.ReadFront(1));
  return front == std::string(front.size(), '\0') ? absl::OkStatus() : CheckFront(connection);
}

// Whether the file is a sound map without its journal, which is removed then.
absl::StatusOr<bool> RemoveNeedlessJournal(const std::string& path, const std::string& journal) {
  ASSIGN_OR_RETURN(Connection connection, OpenConnection(path, Access::kAsItIs));
  RETURN_IF_ERROR(CheckMayBeMap(connection));
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, connection.FileBytes());
  if (file_bytes == 0) return false;  // SQLite would start to write it
  // The lock of a writer: if a build that works has it, the journal is that build's.
  const absl::Status locked = connection.Execute(schema::kBeginWrite);
  if (absl::IsUnavailable(locked) || absl::IsPermissionDenied(locked)) return locked;
  if (!locked.ok()) return false;
  const absl::StatusOr<std::vector<std::string>> problems = FindProblems(connection);
  if (!problems.ok() || !problems->empty()) return false;
  RETURN_IF_ERROR(connection.SyncFile());
  RETURN_IF_ERROR(RemoveFile(journal));
  return true;
}

}  // namespace

absl::StatusOr<Recovery> RecoverMap(const std::string& path) {
  RETURN_IF_ERROR(CheckIsFile(path));
  const std::string journal = JournalOf(path);
  const JournalState state = LookAtJournal(journal);
  if (state == JournalState::kNone || state == JournalState::kIdle) return Recovery::kNothingToDo;
  ASSIGN_OR_RETURN(const bool is_sound, RemoveNeedlessJournal(path, journal));
  if (is_sound) return Recovery::kJournalRemoved;
  RETURN_IF_ERROR(OpenForWriting(path, Access::kRecover).status());
  return Recovery::kRolledBack;
}

}  // namespace scanloc::mapdb
