#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "calibration_rows.hpp"
#include "checksum.hpp"
#include "file_layer.hpp"
#include "folder.hpp"
#include "key_rows.hpp"
#include "map_rows.hpp"
#include "open_map.hpp"
#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {
namespace {

// Collects what is damaged, until there is enough.
class Problems {
 public:
  void Add(std::string_view line) {
    if (!full()) lines_.emplace_back(line);
  }
  // True if there was nothing to add.
  bool Add(const absl::Status& status) {
    if (!status.ok()) Add(DamageOf(status));
    return status.ok();
  }
  [[nodiscard]] bool full() const { return lines_.size() >= kMaxProblems; }
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  [[nodiscard]] std::vector<std::string> Take() && { return std::move(lines_); }

 private:
  std::vector<std::string> lines_;
};

// Steps a cursor; false at the end or where SQLite cannot go on, which is noted.
template <typename Cursor>
bool Next(Cursor& cursor, Problems& problems) {
  const absl::StatusOr<bool> row = cursor.Step();
  return !problems.full() && problems.Add(row.status()) && *row;
}

void RunIntegrityCheck(std::string_view sql, Connection& connection, Problems& problems) {
  absl::StatusOr<Statement> rows = connection.Prepare(sql);
  if (!problems.Add(rows.status())) return;
  while (Next(*rows, problems)) {
    if (rows->Text(0) != "ok") problems.Add(absl::StrCat("SQLite: ", std::string(rows->Text(0))));
  }
}

// The check executes constraints, so that of tables that we do not know must not run.
void CheckIntegrity(Connection& connection, const MapHead& head, Problems& problems) {
  if (!head.has_additions) return RunIntegrityCheck(schema::kCheckIntegrity, connection, problems);
  for (const schema::Table& table : schema::kTables) {
    RunIntegrityCheck(absl::StrCat(schema::kCheckIntegrity, "(", table.name, ")"), connection,
                      problems);
  }
}

bool KeysMatchCells(const ContextShape& shape, ContextValues& values) {
  Context context{shape.num_rows, shape.num_cols, std::move(values.cells_cm)};
  const Keys keys = MakeKeys(context);
  values.cells_cm = std::move(context.cells_cm);
  return keys.retrieval_cm == values.retrieval_cm && keys.aligning_cm == values.aligning_cm;
}

// What other rows say of a row again.
struct RowSums {
  std::int64_t checksum = 0;
  std::int64_t keys_hash = 0;      // of a context's retrieval key, of a structure's ground
  std::int64_t bearings_hash = 0;  // of a structure
};

std::int64_t HashOf(const std::vector<std::int32_t>& key_cm) {
  Hasher hasher;
  for (const std::int32_t sum_cm : key_cm) hasher.Add(std::int64_t{sum_cm});
  return hasher.Digest64();
}

std::int64_t HashOf(const PlaceGround& place) {
  const Ground& ground = place.ground;
  return Hasher()
      .Add(double{ground.roll_rad})
      .Add(double{ground.pitch_rad})
      .Add(double{ground.height_m})
      .Add(std::int64_t{place.has_posts})
      .Digest64();
}

std::int64_t HashOf(const BearingGrid& bearings) {
  Hasher hasher;
  for (const std::uint64_t ring : bearings.rings()) hasher.Add(static_cast<std::int64_t>(ring));
  return hasher.Digest64();
}

// Gives the sums of all contexts in order, for the checksums of the places and the keys.
std::vector<RowSums> CheckContexts(Connection& connection, const Params& params,
                                   Problems& problems) {
  std::vector<RowSums> checksums;
  absl::StatusOr<ContextCursor> contexts = ContextCursor::Open(connection, params);
  if (!problems.Add(contexts.status())) return checksums;
  ContextValues values;
  while (Next(*contexts, problems)) {
    if (problems.Add(contexts->Read(values)) && !KeysMatchCells(contexts->shape(), values)) {
      problems.Add(absl::StrCat("place ", contexts->place(), ", context row ", checksums.size(),
                                ": its keys are not those of its cells"));
    }
    checksums.push_back({values.checksum, HashOf(values.retrieval_cm)});
  }
  return checksums;
}

// The same of structures.
std::vector<RowSums> CheckStructures(Connection& connection, const MapHead& head,
                                     Problems& problems) {
  std::vector<RowSums> checksums;
  absl::StatusOr<StructureCursor> structures = StructureCursor::Open(connection, head);
  if (!problems.Add(structures.status())) return checksums;
  Structure structure;
  while (Next(*structures, problems)) {
    RowSums& sums = checksums.emplace_back();
    problems.Add(structures->Read(structure, sums.checksum));
    sums.keys_hash = HashOf(PlaceGround{structure.ground(), !structure.posts.empty()});
    sums.bearings_hash = HashOf(BearingsOf(structure.posts, head.params));
  }
  return checksums;
}

// Adds the checksums of what place `place` has of `checksums`, num_each a place.
void AddChecksums(const std::vector<RowSums>& checksums, std::size_t place, std::size_t num_each,
                  Hasher& hasher) {
  for (std::size_t i = place * num_each; i < (place + 1) * num_each && i < checksums.size(); ++i) {
    hasher.Add(checksums[i].checksum);
  }
}

void CheckCount(const char* what, std::size_t num_found, std::size_t num_places,
                std::size_t num_each, Problems& problems) {
  if (num_found == num_places * num_each) return;
  problems.Add(absl::StrCat("it has ", num_found, " ", what, "; its ", num_places, " places need ",
                            num_places * num_each));
}

void CheckPlaces(Connection& connection, const MapHead& head, const std::vector<RowSums>& contexts,
                 const std::vector<RowSums>& structures, Problems& problems) {
  absl::StatusOr<PlaceCursor> places = PlaceCursor::Open(connection, head);
  if (!problems.Add(places.status())) return;
  const std::size_t contexts_each = ContextShapes(head.params).size();
  const std::size_t structures_each = head.params.structure.enabled ? 1 : 0;
  ContentHasher content(head.param_texts);
  Hasher hasher;
  PlaceRow row;
  std::size_t num_places = 0;
  bool all_read = true;
  for (; Next(*places, problems); ++num_places) {
    if (!problems.Add(places->Read(row))) {
      all_read = false;
      continue;
    }
    content.AddSessionsBefore(static_cast<std::size_t>(row.session) + 1, head.sessions);
    content.AddPlace(row);
    StartPlaceChecksum(row, hasher);
    AddChecksums(contexts, num_places, contexts_each, hasher);
    AddChecksums(structures, num_places, structures_each, hasher);
    if (hasher.Digest64() != row.checksum) {
      problems.Add(absl::StrCat("place ", row.id, ": its checksum does not match"));
    }
  }
  problems.Add(places->CheckEnd());
  CheckCount("contexts", contexts.size(), num_places, contexts_each, problems);
  CheckCount("structures", structures.size(), num_places, structures_each, problems);
  content.AddSessionsBefore(head.sessions.size(), head.sessions);
  if (all_read && content.ContentId() != head.content_id) {
    problems.Add("its content id does not match its content");
  }
}

// Whether the keys are those of the contexts and structures that they were taken from.
void CheckKeys(Connection& connection, const MapHead& head, const std::vector<RowSums>& contexts,
               const std::vector<RowSums>& structures, Problems& problems) {
  absl::StatusOr<KeysCursor> cursor = KeysCursor::Open(connection, head);
  if (!problems.Add(cursor.status())) return;
  const std::size_t contexts_each = ContextShapes(head.params).size();
  std::size_t num_rows = 0;
  PlaceKeys keys;
  for (; Next(*cursor, problems); ++num_rows) {
    if (!problems.Add(cursor->Read(keys))) continue;
    bool is_same = (num_rows + 1) * contexts_each <= contexts.size();
    for (std::size_t i = 0; is_same && i < contexts_each; ++i) {
      const RowSums& context = contexts[num_rows * contexts_each + i];
      is_same = context.checksum == keys.checksums[i] &&
                context.keys_hash == HashOf(keys.retrieval_cm[i]);
    }
    if (is_same && head.params.structure.enabled) {
      is_same = num_rows < structures.size() &&
                structures[num_rows].checksum == keys.checksums.back() &&
                structures[num_rows].keys_hash == HashOf(keys.ground);
    }
    if (!is_same) {
      problems.Add(absl::StrCat("keys of place ", num_rows,
                                ": they are not those of its contexts and structure"));
    }
  }
  CheckCount("keys", num_rows, static_cast<std::size_t>(head.num_places()), 1, problems);
}

void CheckBearings(Connection& connection, const MapHead& head,
                   const std::vector<RowSums>& structures, Problems& problems) {
  absl::StatusOr<BearingsCursor> cursor = BearingsCursor::Open(connection, head);
  if (!problems.Add(cursor.status())) return;
  std::size_t num_rows = 0;
  for (; Next(*cursor, problems); ++num_rows) {
    const absl::StatusOr<BearingGrid> bearings = cursor->Read();
    if (!problems.Add(bearings.status())) continue;
    if (num_rows >= structures.size() || structures[num_rows].bearings_hash != HashOf(*bearings)) {
      problems.Add(
          absl::StrCat("bearings of place ", num_rows, ": they are not those of its structure"));
    }
  }
  CheckCount("bearings", num_rows, static_cast<std::size_t>(head.num_places()),
             head.params.structure.enabled ? 1 : 0, problems);
}

void CheckRows(Connection& connection, const MapHead& head, Problems& problems) {
  const std::vector<RowSums> contexts = CheckContexts(connection, head.params, problems);
  std::vector<RowSums> structures;
  if (head.schema_version >= 2) structures = CheckStructures(connection, head, problems);
  CheckPlaces(connection, head, contexts, structures, problems);
  if (head.schema_version >= schema::kKeysVersion) {
    CheckKeys(connection, head, contexts, structures, problems);
  }
  if (head.schema_version >= schema::kBearingsVersion) {
    CheckBearings(connection, head, structures, problems);
  }
  problems.Add(ReadCalibration(connection, head).status());
}

// Damage is an answer of FindProblems; what is no map that this version can read is an error.
bool IsDamage(const absl::Status& status) { return absl::IsDataLoss(status); }

/// FindProblems of map_file.hpp, for a map that is open.
absl::StatusOr<std::vector<std::string>> FindProblems(Connection& connection) {
  Problems problems;
  absl::StatusOr<MapHead> head = ReadVersions(connection);
  if (!head.ok() && !IsDamage(head.status())) return head.status();
  if (problems.Add(head.status())) {
    CheckIntegrity(connection, *head, problems);
    if (problems.Add(ReadTables(connection, *head)) &&
        problems.Add(CheckRoomForPlaces(connection, *head))) {
      CheckRows(connection, *head, problems);
    }
  }
  return std::move(problems).Take();
}

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

absl::StatusOr<std::vector<std::string>> FindProblems(const std::string& path) {
  absl::StatusOr<Connection> connection = OpenForReading(path);
  if (connection.ok()) return FindProblems(*connection);
  if (!IsDamage(connection.status())) return connection.status();
  return std::vector<std::string>{DamageOf(connection.status())};
}

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
