// Files that are no map, or one that was altered.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "open_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::BuildSmallMap;
using test::Sql;
using test::TempDir;
using testing::HasSubstr;

// All four functions refuse a file in the same way.
void ExpectRefused(const std::string& path, absl::StatusCode code, const std::string& message) {
  for (const absl::Status& status : {LoadMap(path).status(), ReadInfo(path).status(),
                                     ReadPlaces(path).status(), FindProblems(path).status()}) {
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
    EXPECT_THAT(std::string(status.message()), HasSubstr(path));
  }
}

// As above, but FindProblems' answer is the list of what is damaged.
void ExpectDamaged(const std::string& path, const std::string& problem) {
  for (const absl::Status& status : {LoadMap(path).status(), ReadInfo(path).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(problem));
  }
  const auto problems = FindProblems(path);
  ASSERT_TRUE(problems.ok()) << problems.status();
  EXPECT_THAT(*problems, testing::Contains(HasSubstr(problem)));
}

TEST(MapFile, RefusesAFileThatIsNotThere) {
  const TempDir dir;
  ExpectRefused(dir.File("none.scanloc"), absl::StatusCode::kNotFound, "no map file");
  EXPECT_FALSE(std::filesystem::exists(dir.File("none.scanloc")));
}

TEST(MapFile, RefusesAFolder) {
  const TempDir dir;
  ExpectRefused(dir.path().string(), absl::StatusCode::kInvalidArgument, "is a folder");
}

TEST(MapFile, RefusesAPipeWithoutWaitingForIt) {
  const TempDir dir;
  ASSERT_EQ(mkfifo(dir.File("pipe").c_str(), 0600), 0);
  ExpectRefused(dir.File("pipe"), absl::StatusCode::kInvalidArgument, "not a file");
}

TEST(MapFile, RefusesNamesThatMeanSomethingToSqliteOnly) {
  for (const std::string name : {":memory:", "file::memory:", "file:x?mode=memory"}) {
    EXPECT_EQ(LoadMap(name).status().code(), absl::StatusCode::kNotFound) << name;
  }
  EXPECT_EQ(LoadMap("").status().code(), absl::StatusCode::kNotFound);
}

TEST(MapFile, RefusesAnEmptyFile) {
  const TempDir dir;
  ExpectRefused(dir.Write("empty", ""), absl::StatusCode::kInvalidArgument, "is empty");
}

TEST(MapFile, RefusesWhatIsNotSqlite) {
  const TempDir dir;
  for (const std::size_t size : {2, 15, 16, 99, 100, 511, 512, 5000, 100000}) {
    ExpectRefused(dir.Write("text", std::string(size, 'x')), absl::StatusCode::kInvalidArgument,
                  "not an SQLite file");
  }
}

TEST(MapFile, RefusesTheDatabaseOfAnotherApplication) {
  const TempDir dir;
  const std::string path = dir.File("other.db");
  Sql(path, "PRAGMA application_id = 77; CREATE TABLE tiles (id INTEGER PRIMARY KEY)");
  ExpectRefused(path, absl::StatusCode::kInvalidArgument, "another application");
}

TEST(MapFile, RefusesADatabaseWithoutTables) {
  const TempDir dir;
  const std::string path = dir.File("ours.db");
  Sql(path, "PRAGMA application_id = 1397509955");
  ExpectDamaged(path, "no such table");
}

class AlteredMap : public testing::Test {
 protected:
  AlteredMap() : path_(dir_.File("a.scanloc")) {
    const auto summary = BuildSmallMap(path_, 4);
    EXPECT_TRUE(summary.ok()) << summary.status();
  }
  void Alter(const std::string& sql) { Sql(path_, sql); }

  TempDir dir_;
  std::string path_;
};

TEST_F(AlteredMap, IsRefusedInWriteAheadMode) {
  Alter("PRAGMA journal_mode = WAL");
  for (const absl::Status& status : {LoadMap(path_).status(), ReadInfo(path_).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("rollback-journal mode"));
  }
  EXPECT_FALSE(std::filesystem::exists(path_ + "-wal"));
}

TEST_F(AlteredMap, IsRefusedWithATriggerAViewOrAnotherTable) {
  const TempDir copies;
  const std::string additions[] = {
      "CREATE TRIGGER t AFTER INSERT ON places BEGIN DELETE FROM places; END",
      "CREATE VIEW v AS SELECT id FROM places", "CREATE TABLE more (id INTEGER PRIMARY KEY)",
      "CREATE INDEX i ON places (scan)", "ALTER TABLE places ADD COLUMN more INTEGER"};
  for (const std::string& addition : additions) {
    const std::string copy = copies.Write("copy.scanloc", test::ReadFile(path_));
    Sql(copy, addition);
    ExpectDamaged(copy, "schema");
  }
}

TEST_F(AlteredMap, IsRefusedWithAViewInPlaceOfATable) {
  Alter(
      "ALTER TABLE meta RENAME TO hidden;"
      "CREATE VIEW meta AS SELECT key, value, checksum FROM hidden");
  ExpectDamaged(path_, "");
}

// A column that computes for hours when it is read.
constexpr char kHostileColumn[] =
    "value TEXT AS (replace(hex(zeroblob(999)), '0', hex(zeroblob(99))) LIKE '%0%0%0%0%0%0%1')";

TEST_F(AlteredMap, IsRefusedBeforeAnythingInItIsExecuted) {
  const TempDir copies;
  for (const std::string name : {"meta", "META"}) {
    for (const std::string version : {"2", "9"}) {
      const std::string copy = copies.Write("copy.scanloc", test::ReadFile(path_));
      Sql(copy,
          absl::StrCat("DROP TABLE meta; CREATE TABLE ", name, " (key TEXT NOT NULL PRIMARY KEY, ",
                       kHostileColumn, ", checksum INTEGER NOT NULL); INSERT INTO ", name,
                       " (key, checksum) VALUES ('version', ", version, ")"));
      ExpectDamaged(copy, "schema");
      EXPECT_EQ(MapBuilder::Append(copy, test::SmallPlan("two", 1)).status().code(),
                absl::StatusCode::kDataLoss);
    }
  }
}

TEST_F(AlteredMap, IsRefusedWithMoreTablesThanAnyVersionHas) {
  std::string sql = "BEGIN;";
  for (int i = 0; i < 200; ++i) absl::StrAppend(&sql, "CREATE TABLE more", i, " (id INTEGER);");
  Alter(sql + "COMMIT");
  ExpectDamaged(path_, "more than 100");
}

TEST_F(AlteredMap, NamesInItArePrintable) {
  Alter("CREATE TABLE \"x\n\x1b[2J\u202e\" (id INTEGER)");
  ExpectDamaged(path_, "'x\\n\\x1b[2J\\u202e'");
}

TEST_F(AlteredMap, IsReadWithinALimitOfTime) {
  constexpr char kEndless[] =
      "WITH RECURSIVE n (x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT count(*) FROM n";
  auto connection = OpenForReading(path_);
  ASSERT_TRUE(connection.ok()) << connection.status();
  connection->LimitTime(std::chrono::milliseconds(1));
  const absl::Status status = connection->QueryInt(kEndless).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
}

TEST_F(AlteredMap, IsRefusedWithoutATable) {
  Alter("DROP TABLE sessions");
  ExpectDamaged(path_, "table is missing");
}

TEST_F(AlteredMap, IsRefusedWithAnotherValueInAnyColumn) {
  const TempDir copies;
  const std::pair<std::string, std::string> changes[] = {
      {"UPDATE meta SET value = 'x' WHERE key = 'built_by'", "meta"},
      {"UPDATE meta SET value = 'x' WHERE key = 'content_id'", "meta"},
      {"DELETE FROM meta WHERE key = 'built_by'", "meta"},
      {"UPDATE params SET value = '0.6' WHERE name = 'voxel_size_m'", "params"},
      {"DELETE FROM params WHERE name = 'voxel_size_m'", "voxel_size_m is missing"},
      {"UPDATE sessions SET name = 'two'", "session 0"},
      {"UPDATE sessions SET num_places = 3", "session 0"},
      {"UPDATE sessions SET num_scans = num_scans + 1", "session 0"},
      {"UPDATE sessions SET id = 1", "session 0"},
      {"DELETE FROM sessions", "no session"},
      {"UPDATE places SET stamp_ns = 7 WHERE id = 2", "does not match"},
      {"UPDATE places SET session = 1 WHERE id = 2", "place 2"},
      {"UPDATE places SET T_map_place = zeroblob(96) WHERE id = 2", "place 2: the pose"},
      {"UPDATE places SET T_map_place = zeroblob(95) WHERE id = 2", "place 2"},
      {"UPDATE places SET scan = 'x' WHERE id = 2", "does not match"},
      {"UPDATE places SET scan = '' WHERE id = 2", "place 2"},
      {"UPDATE places SET num_voxels = 7 WHERE id = 2", "does not match"},
      {"UPDATE places SET num_voxels = -7 WHERE id = 2", "place 2"},
      {"UPDATE places SET checksum = 7 WHERE id = 2", "does not match"},
      {"UPDATE places SET id = 9 WHERE id = 2", "place 2"},
      {"DELETE FROM places WHERE id = 3", "3 places"},
      {"DELETE FROM places WHERE id = 1", "place 1"},
      {"INSERT INTO places SELECT 4, session, stamp_ns, T_map_place, scan, num_voxels, checksum"
       " FROM places WHERE id = 3",
       "more than the 4 places"}};
  for (const auto& [change, problem] : changes) {
    SCOPED_TRACE(change);
    const std::string copy = copies.Write("copy.scanloc", test::ReadFile(path_));
    Sql(copy, change);
    ExpectDamaged(copy, problem);
  }
}

TEST_F(AlteredMap, IsNotLoadedWithOtherContexts) {
  const TempDir copies;
  const std::pair<std::string, std::string> changes[] = {
      {"UPDATE contexts SET cells = zeroblob(3) WHERE id = 5", "place 1, polar context 1"},
      {"UPDATE contexts SET cells = zeroblob(4000000) WHERE id = 5", "place 1, polar context 1"},
      {"UPDATE contexts SET retrieval_key = zeroblob(16) WHERE id = 7", "place 1, cart context 0"},
      {"UPDATE contexts SET aligning_key = zeroblob(24) WHERE id = 7", "place 1, cart context 0"},
      {"UPDATE contexts SET kind = 1 WHERE id = 5", "place 1, polar context 1"},
      {"UPDATE contexts SET variant = 2 WHERE id = 5", "place 1, polar context 1"},
      {"UPDATE contexts SET place = 0 WHERE id = 5", "place 1, polar context 1"},
      {"UPDATE contexts SET checksum = 0 WHERE id = 5", "place 1, polar context 1"},
      {"DELETE FROM contexts WHERE id = 5", "place 1, polar context 1"},
      {"DELETE FROM contexts WHERE id = 15", "contexts"},
      {"INSERT INTO contexts SELECT 16, place, kind, variant, checksum, retrieval_key,"
       " aligning_key, cells FROM contexts WHERE id = 15",
       "contexts"}};
  for (const auto& [change, problem] : changes) {
    SCOPED_TRACE(change);
    const std::string copy = copies.Write("copy.scanloc", test::ReadFile(path_));
    Sql(copy, change);
    const absl::Status status = LoadMap(copy).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(problem));
    const auto problems = FindProblems(copy);
    ASSERT_TRUE(problems.ok());
    EXPECT_FALSE(problems->empty());
  }
}

TEST_F(AlteredMap, IsOpenedAfterAVacuum) {
  const auto before = LoadMap(path_);
  Alter("VACUUM");
  const auto after = LoadMap(path_);
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_TRUE(test::SameMap(*after, *before));
}

}  // namespace
}  // namespace scanloc::mapdb
