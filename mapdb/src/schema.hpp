#pragma once

#include <array>
#include <cstdint>

/// Every SQL statement of scanloc, and the numbers that mark its files (docs/map_format.md).
namespace scanloc::mapdb::schema {

inline constexpr std::uint32_t kApplicationId = 0x534C4F43;  // "SLOC"; persisted, never change
inline constexpr int kVersion = 16;                          ///< of the files that this code writes
inline constexpr int kCompatibleVersion = 9;  ///< oldest version whose readers can read these files

struct Table {
  const char* name;
  const char* create_sql;
  int since_version;
  int until_version = kVersion;

  [[nodiscard]] constexpr bool IsOf(int version) const {
    return since_version <= version && (version <= until_version || until_version == kVersion);
  }
};

inline constexpr const char* kMetaTable = "meta";  ///< the same in all versions

/// The checksum in a row covers all other columns of the row.
inline constexpr std::array<Table, 11> kTables = {{
    {kMetaTable,
     "CREATE TABLE meta (key TEXT NOT NULL PRIMARY KEY, value TEXT NOT NULL,"
     " checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID",
     1},
    {"params",
     "CREATE TABLE params (name TEXT NOT NULL PRIMARY KEY, value TEXT NOT NULL,"
     " checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID",
     1},
    {"sessions",
     "CREATE TABLE sessions (id INTEGER NOT NULL PRIMARY KEY, name TEXT NOT NULL,"
     " plan_hash TEXT NOT NULL, num_scans INTEGER NOT NULL, num_places INTEGER NOT NULL,"
     " num_empty INTEGER NOT NULL, num_unreadable INTEGER NOT NULL,"
     " checksum INTEGER NOT NULL) STRICT",
     1},
    {"places",
     "CREATE TABLE places (id INTEGER NOT NULL PRIMARY KEY,"
     " session INTEGER NOT NULL REFERENCES sessions (id), stamp_ns INTEGER NOT NULL,"
     " T_map_place BLOB NOT NULL, scan TEXT NOT NULL, num_voxels INTEGER NOT NULL,"
     " checksum INTEGER NOT NULL) STRICT",
     1},
    {"contexts",
     "CREATE TABLE contexts (id INTEGER NOT NULL PRIMARY KEY,"
     " place INTEGER NOT NULL REFERENCES places (id), kind INTEGER NOT NULL,"
     " variant INTEGER NOT NULL, checksum INTEGER NOT NULL, retrieval_key BLOB NOT NULL,"
     " aligning_key BLOB NOT NULL, cells BLOB NOT NULL) STRICT",
     1},
    {"structures",
     "CREATE TABLE structures (place INTEGER NOT NULL PRIMARY KEY REFERENCES places (id),"
     " roll_rad REAL NOT NULL, pitch_rad REAL NOT NULL, height_m REAL NOT NULL,"
     " checksum INTEGER NOT NULL, columns BLOB NOT NULL) STRICT",
     2, 2},
    {"structures",
     "CREATE TABLE structures (place INTEGER NOT NULL PRIMARY KEY REFERENCES places (id),"
     " roll_rad REAL NOT NULL, pitch_rad REAL NOT NULL, height_m REAL NOT NULL,"
     " checksum INTEGER NOT NULL, posts BLOB NOT NULL) STRICT",
     3},
    {"calibration",
     "CREATE TABLE calibration (id INTEGER NOT NULL PRIMARY KEY, content_id TEXT NOT NULL,"
     " bias REAL NOT NULL, score_weight REAL NOT NULL, margin_weight REAL NOT NULL,"
     " num_trials INTEGER NOT NULL, num_confusable INTEGER NOT NULL, checksum INTEGER NOT NULL)"
     " STRICT",
     2},
    {"confusable",
     "CREATE TABLE confusable (id INTEGER NOT NULL PRIMARY KEY, place INTEGER NOT NULL,"
     " lookalike INTEGER NOT NULL, confidence REAL NOT NULL, checksum INTEGER NOT NULL) STRICT",
     2},
    // What is needed to find candidates, without the contexts and structures that it is taken from.
    {"keys",
     "CREATE TABLE keys (place INTEGER NOT NULL PRIMARY KEY REFERENCES places (id),"
     " roll_rad REAL NOT NULL, pitch_rad REAL NOT NULL, height_m REAL NOT NULL,"
     " num_posts INTEGER NOT NULL, checksum INTEGER NOT NULL, retrieval_keys BLOB NOT NULL,"
     " checksums BLOB NOT NULL) STRICT",
     5},
    {"bearings",
     "CREATE TABLE bearings (place INTEGER NOT NULL PRIMARY KEY REFERENCES places (id),"
     " checksum INTEGER NOT NULL, rings BLOB NOT NULL) STRICT",
     6},
}};

inline constexpr int kKeysVersion = 5;      ///< the first whose files have the table `keys`
inline constexpr int kBearingsVersion = 6;  ///< the first whose files have the table `bearings`
inline constexpr int kHeightsVersion = 8;   ///< the first whose posts have heights
inline constexpr int kInliersVersion = 9;   ///< the first that asks how exactly posts lie on others
inline constexpr int kMirrorVersion = 13;   ///< the first that asks less of a mirror image
inline constexpr int kBesideVersion = 14;   ///< the first that asks the places beside a spot
inline constexpr int kLeadVersion = 16;     ///< the first that asks how far a cohort is behind

// Keys of meta.
inline constexpr const char* kVersionKey = "version";
inline constexpr const char* kCompatibleVersionKey = "compatible_version";
inline constexpr const char* kBuiltByKey = "built_by";
inline constexpr const char* kContentIdKey = "content_id";
inline constexpr const char* kHistoryKey = "history";       ///< only of maps made of others
inline constexpr const char* kGeoOriginKey = "geo_origin";  ///< only where that was told

inline constexpr const char* kConfigureReader =
    "PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; PRAGMA temp_store = MEMORY";
/// For a connection that looks up single rows: the pages between root and rows stay [KiB].
inline constexpr const char* kConfigureLookup = "PRAGMA cache_size = -8000";
// A map is one file: a journal that is deleted at every commit, its folder synced, and nothing
// spilled before one.
// Page size and encoding hold for a new file only (docs/map_format.md, "Why so").
inline constexpr const char* kConfigureWriter =
    "PRAGMA page_size = 8192; PRAGMA encoding = 'UTF-8'; PRAGMA cell_size_check = ON; PRAGMA "
    "mmap_size = 0; PRAGMA journal_mode = DELETE;"
    " PRAGMA synchronous = EXTRA; PRAGMA cache_spill = OFF";
inline constexpr const char* kSetApplicationId = "PRAGMA application_id = 1397509955";
static_assert(kApplicationId == 1397509955);
inline constexpr const char* kCountPages = "PRAGMA page_count";
inline constexpr const char* kDataVersion = "PRAGMA data_version";
inline constexpr const char* kCheckIntegrity = "PRAGMA integrity_check";

inline constexpr const char* kBeginRead = "BEGIN";
inline constexpr const char* kBeginWrite = "BEGIN IMMEDIATE";
inline constexpr const char* kCommit = "COMMIT";
inline constexpr const char* kRollback = "ROLLBACK";

inline constexpr const char* kSelectSchema =
    "SELECT type, name, sql FROM sqlite_schema ORDER BY rowid";
inline constexpr const char* kSelectMeta = "SELECT key, value, checksum FROM meta ORDER BY key";
inline constexpr const char* kSelectParams =
    "SELECT name, value, checksum FROM params ORDER BY name";
inline constexpr const char* kSelectSessions =
    "SELECT id, name, plan_hash, num_scans, num_places, num_empty, num_unreadable, checksum"
    " FROM sessions ORDER BY id";
inline constexpr const char* kSelectPlaces =
    "SELECT id, session, stamp_ns, T_map_place, scan, num_voxels, checksum"
    " FROM places ORDER BY id";
inline constexpr const char* kSelectContexts =
    "SELECT id, place, kind, variant, checksum, retrieval_key, aligning_key, cells"
    " FROM contexts ORDER BY id";

inline constexpr const char* kSelectContext =
    "SELECT id, place, kind, variant, checksum, retrieval_key, aligning_key, cells"
    " FROM contexts WHERE id = ?1";

inline constexpr const char* kSelectStructures2 =
    "SELECT place, roll_rad, pitch_rad, height_m, checksum, columns FROM structures ORDER BY place";
inline constexpr const char* kSelectStructures =
    "SELECT place, roll_rad, pitch_rad, height_m, checksum, posts FROM structures ORDER BY place";
inline constexpr const char* kSelectStructure =
    "SELECT place, roll_rad, pitch_rad, height_m, checksum, posts FROM structures WHERE place = ?1";
inline constexpr const char* kSelectKeys =
    "SELECT place, roll_rad, pitch_rad, height_m, num_posts, checksum, retrieval_keys, checksums"
    " FROM keys ORDER BY place";
inline constexpr const char* kSelectKeysOfPlace =
    "SELECT place, roll_rad, pitch_rad, height_m, num_posts, checksum, retrieval_keys, checksums"
    " FROM keys WHERE place = ?1";
inline constexpr const char* kSelectBearings =
    "SELECT place, checksum, rings FROM bearings ORDER BY place";
inline constexpr const char* kSelectBearingsOfPlace =
    "SELECT place, checksum, rings FROM bearings WHERE place = ?1";
inline constexpr const char* kSelectCalibration =
    "SELECT id, content_id, bias, score_weight, margin_weight, num_trials, num_confusable, checksum"
    " FROM calibration ORDER BY id";
inline constexpr const char* kSelectConfusable =
    "SELECT id, place, lookalike, confidence, checksum FROM confusable ORDER BY id";

inline constexpr const char* kInsertMeta =
    "INSERT INTO meta (key, value, checksum) VALUES (?1, ?2, ?3)";
/// Replaces a row that is there.
inline constexpr const char* kSetMeta =
    "INSERT OR REPLACE INTO meta (key, value, checksum) VALUES (?1, ?2, ?3)";
inline constexpr const char* kInsertParam =
    "INSERT INTO params (name, value, checksum) VALUES (?1, ?2, ?3)";
inline constexpr const char* kInsertSession =
    "INSERT INTO sessions (id, name, plan_hash, num_scans, num_places, num_empty, num_unreadable,"
    " checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
inline constexpr const char* kInsertPlace =
    "INSERT INTO places (id, session, stamp_ns, T_map_place, scan, num_voxels, checksum)"
    " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
inline constexpr const char* kInsertContext =
    "INSERT INTO contexts (id, place, kind, variant, checksum, retrieval_key, aligning_key, cells)"
    " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
inline constexpr const char* kInsertStructure2 =
    "INSERT INTO structures (place, roll_rad, pitch_rad, height_m, checksum, columns)"
    " VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
inline constexpr const char* kInsertStructure =
    "INSERT INTO structures (place, roll_rad, pitch_rad, height_m, checksum, posts)"
    " VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
inline constexpr const char* kInsertKeys =
    "INSERT INTO keys (place, roll_rad, pitch_rad, height_m, num_posts, checksum, retrieval_keys,"
    " checksums) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
inline constexpr const char* kInsertBearings =
    "INSERT INTO bearings (place, checksum, rings) VALUES (?1, ?2, ?3)";
inline constexpr const char* kDeleteCalibration = "DELETE FROM calibration";
inline constexpr const char* kDeleteConfusable = "DELETE FROM confusable";
inline constexpr const char* kInsertCalibration =
    "INSERT INTO calibration (id, content_id, bias, score_weight, margin_weight, num_trials,"
    " num_confusable, checksum) VALUES (0, ?1, ?2, ?3, ?4, ?5, ?6, ?7)";
inline constexpr const char* kInsertConfusable =
    "INSERT INTO confusable (id, place, lookalike, confidence, checksum)"
    " VALUES (?1, ?2, ?3, ?4, ?5)";
inline constexpr const char* kUpdateMeta =
    "UPDATE meta SET value = ?2, checksum = ?3 WHERE key = ?1";
inline constexpr const char* kUpdateSession =
    "UPDATE sessions SET num_places = ?2, num_empty = ?3, num_unreadable = ?4, checksum = ?5"
    " WHERE id = ?1";

}  // namespace scanloc::mapdb::schema
