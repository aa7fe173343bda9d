#include <string>
#include <vector>

#include "file_layer.hpp"
#include "find_problems.hpp"
#include "folder.hpp"
#include "open_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {
namespace {

// A build that was killed in its first commit leaves a file with or without a front.
absl::Status CheckMayBeMap(Connection& connection) {
  const absl::StatusOr<std::string> front = connection.ReadFront(1);
  if (!front.ok()) return front.status();
  return *front == std::string(front->size(), '\0') ? absl::OkStatus() : CheckFront(connection);
}

// Whether the file is a sound map without its journal, which is removed then.
absl::StatusOr<bool> RemoveNeedlessJournal(const std::string& path, const std::string& journal) {
  absl::StatusOr<Connection> connection = OpenConnection(path, Access::kAsItIs);
  if (!connection.ok()) return connection.status();
  if (absl::Status status = CheckMayBeMap(*connection); !status.ok()) return status;
  const absl::StatusOr<std::int64_t> file_bytes = connection->FileBytes();
  if (!file_bytes.ok()) return file_bytes.status();
  if (*file_bytes == 0) return false;  // SQLite would start to write it
  // The lock of a writer: if a build that works has it, the journal is that build's.
  const absl::Status locked = connection->Execute(schema::kBeginWrite);
  if (absl::IsUnavailable(locked) || absl::IsPermissionDenied(locked)) return locked;
  if (!locked.ok()) return false;
  const absl::StatusOr<std::vector<std::string>> problems = FindProblems(*connection);
  if (!problems.ok() || !problems->empty()) return false;
  if (absl::Status status = connection->SyncFile(); !status.ok()) return status;
  if (absl::Status status = RemoveFile(journal); !status.ok()) return status;
  return true;
}

}  // namespace

absl::StatusOr<Recovery> RecoverMap(const std::string& path) {
  if (absl::Status status = CheckIsFile(path); !status.ok()) return status;
  const std::string journal = JournalOf(path);
  const JournalState state = LookAtJournal(journal);
  if (state == JournalState::kNone || state == JournalState::kIdle) return Recovery::kNothingToDo;
  const absl::StatusOr<bool> is_sound = RemoveNeedlessJournal(path, journal);
  if (!is_sound.ok()) return is_sound.status();
  if (*is_sound) return Recovery::kJournalRemoved;
  const absl::StatusOr<Connection> connection = OpenForWriting(path, Access::kRecover);
  if (!connection.ok()) return connection.status();
  return Recovery::kRolledBack;
}

}  // namespace scanloc::mapdb
