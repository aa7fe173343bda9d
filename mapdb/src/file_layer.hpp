#pragma once

#include <cstdint>
#include <string>

/// SQLite's way to the file system, narrowed to what a map needs: the map and the journal beside
/// it, regular files both. No write-ahead log, no shared memory, no super-journal, whatever lies
/// there: a journal may be planted, and SQLite would delete the file that it names.
namespace scanloc::mapdb {

enum class Access : std::uint8_t {
  kRead,     ///< nothing is written or deleted; a hot journal is refused
  kWrite,    ///< a hot journal is refused
  kRecover,  ///< as kWrite, but a hot journal is rolled back
  kAsItIs,   ///< as if there were no journal, to look at the map without it; must not write
};

/// The name by which SQLite knows the layer.
[[nodiscard]] const char* FileLayer(Access access);

enum class JournalState : std::uint8_t {
  kNone,
  kIdle,          ///< nothing to undo: the map was not written since the journal was begun
  kHot,           ///< an unfinished write, of a build at work or of one that was killed
  kNamesAnother,  ///< hot, and it names a further file, as no journal of a map does
  kNoFile,        ///< a link, a pipe, a folder or the like, or it cannot be read
};
/// What lies at the path of a journal. Never waits, and follows no link.
[[nodiscard]] JournalState LookAtJournal(const std::string& journal);

/// Where the journal of the map lies: beside the file itself if the path is a link to it.
[[nodiscard]] std::string JournalOf(const std::string& map_path);

}  // namespace scanloc::mapdb
