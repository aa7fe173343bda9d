#include "file_layer.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string_view>
#include <system_error>

#include "scanloc/files/files.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::string_view kJournalSuffix = "-journal";
// At the front of every journal, and at the end of one that names a super-journal
// (https://www.sqlite.org/fileformat.html, "The Rollback Journal").
constexpr std::string_view kJournalMagic("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);
constexpr std::size_t kRecordsOffset = 8;
constexpr std::size_t kPagesOffset = 16;
constexpr std::size_t kJournalFrontBytes = 20;

Access AccessOf(const sqlite3_vfs* layer) { return *static_cast<const Access*>(layer->pAppData); }

// Looked up each time: tests exchange it.
sqlite3_vfs* Base() { return sqlite3_vfs_find(nullptr); }

bool IsJournal(const char* name) {
  return name != nullptr && std::string_view(name).ends_with(kJournalSuffix);
}

template <std::size_t kSize>
bool ReadAt(int fd, off_t offset, std::array<char, kSize>& bytes) {
  return offset >= 0 && pread(fd, bytes.data(), kSize, offset) == static_cast<ssize_t>(kSize);
}

bool IsRegularFile(const char* name) {
  struct stat info = {};
  return lstat(name, &info) == 0 && S_ISREG(info.st_mode);
}

bool MayOpen(Access access, const char* name, int flags) {
  if ((flags & SQLITE_OPEN_MAIN_DB) != 0) return IsRegularFile(name);
  if ((flags & SQLITE_OPEN_MAIN_JOURNAL) == 0) return name == nullptr && access != Access::kRead;
  switch (access) {
    case Access::kRead:
    case Access::kAsItIs:
      return false;
    case Access::kWrite:
      // SQLite opens a journal that is to be rolled back without the wish to make it.
      if ((flags & SQLITE_OPEN_CREATE) == 0) return false;
      break;
    case Access::kRecover:
      break;
  }
  return LookAtJournal(name) != JournalState::kNoFile;
}

int Open(sqlite3_vfs* layer, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  file->pMethods = nullptr;
  if (!MayOpen(AccessOf(layer), name, flags)) return SQLITE_CANTOPEN;
  return Base()->xOpen(Base(), name, file, flags, out_flags);
}

int Delete(sqlite3_vfs* layer, const char* name, int sync_folder) {
  const Access access = AccessOf(layer);
  const bool may_delete = access == Access::kWrite || access == Access::kRecover;
  if (!may_delete || !IsJournal(name)) return SQLITE_IOERR_DELETE;
  return Base()->xDelete(Base(), name, sync_folder);
}

// SQLite asks for the journal, for a write-ahead log and for a super-journal. A journal of which
// nothing can be known counts as hot, so that it is refused.
int Exists(sqlite3_vfs* layer, const char* name, int /*flags*/, int* result) {
  *result = 0;
  if (AccessOf(layer) == Access::kAsItIs || !IsJournal(name)) return SQLITE_OK;
  const JournalState state = LookAtJournal(name);
  *result = state != JournalState::kNone && state != JournalState::kIdle ? 1 : 0;
  return SQLITE_OK;
}

struct Layer {
  const char* name;
  Access access;
  sqlite3_vfs vfs = {};
};

}  // namespace

const char* FileLayer(Access access) {
  static std::mutex mutex;
  static std::array<Layer, 4> layers = {{{"scanloc-read", Access::kRead},
                                         {"scanloc-write", Access::kWrite},
                                         {"scanloc-recover", Access::kRecover},
                                         {"scanloc-as-it-is", Access::kAsItIs}}};
  const std::lock_guard lock(mutex);
  Layer& layer = layers[static_cast<std::size_t>(access)];
  const sqlite3_vfs* base = Base();
  if (base == nullptr) return layer.name;  // SQLite says so when it opens
  if (layer.vfs.zName == nullptr) {
    layer.vfs = *base;
    layer.vfs.pNext = nullptr;
    layer.vfs.zName = layer.name;
    layer.vfs.pAppData = &layer.access;
    layer.vfs.xOpen = Open;
    layer.vfs.xDelete = Delete;
    layer.vfs.xAccess = Exists;
    sqlite3_vfs_register(&layer.vfs, 0);
  }
  if (layer.vfs.szOsFile != base->szOsFile) layer.vfs.szOsFile = base->szOsFile;
  return layer.name;
}

JournalState LookAtJournal(const std::string& journal) {
  const FileDescriptor file(
      open(journal.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0) {
    const bool is_none = errno == ENOENT || errno == ENAMETOOLONG;
    return is_none ? JournalState::kNone : JournalState::kNoFile;
  }
  struct stat info = {};
  if (fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode)) return JournalState::kNoFile;
  std::array<char, kJournalFrontBytes> front = {};
  if (!ReadAt(file.get(), 0, front)) return JournalState::kIdle;
  const std::string_view bytes(front.data(), front.size());
  constexpr std::string_view kZero("\0\0\0\0", 4);
  // Records are counted once they are durable, and only then the map is written; that of a new map
  // has none, which the number of pages that it had before tells.
  const bool has_begun = bytes.substr(kRecordsOffset, kZero.size()) != kZero ||
                         bytes.substr(kPagesOffset, kZero.size()) == kZero;
  if (!bytes.starts_with(kJournalMagic) || !has_begun) return JournalState::kIdle;
  std::array<char, kJournalMagic.size()> end = {};
  const bool names_another = ReadAt(file.get(), info.st_size - off_t{end.size()}, end) &&
                             std::string_view(end.data(), end.size()) == kJournalMagic;
  return names_another ? JournalState::kNamesAnother : JournalState::kHot;
}

std::string JournalOf(const std::string& map_path) {
  std::error_code error;
  const std::filesystem::path file = std::filesystem::canonical(map_path, error);
  return std::string(error ? map_path : file.string()).append(kJournalSuffix);
}

}  // namespace scanloc::mapdb
