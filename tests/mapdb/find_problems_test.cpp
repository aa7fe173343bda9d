#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstring>

#include "absl/strings/str_cat.h"
#include "checksum.hpp"
#include "map_rows.hpp"
#include "open_map.hpp"
#include "scanloc/mapdb/map_builder.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/small_maps.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::Sql;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class VerifyTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto summary = test::BuildSmallMap(path_, 6);
    ASSERT_TRUE(summary.ok()) << summary.status();
  }
  std::vector<std::string> Problems() {
    const auto problems = FindProblems(path_);
    EXPECT_TRUE(problems.ok()) << problems.status();
    return problems.ok() ? *problems : std::vector<std::string>();
  }
  // Sets a value of meta with a checksum that fits, as another version would write it.
  void SetMeta(const std::string& key, const std::string& value) {
    Sql(path_, absl::StrCat("UPDATE meta SET value = '", value, "', checksum = ",
                            MetaChecksum(key, value), " WHERE key = '", key, "'"));
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(VerifyTest, FindsNothingInASoundMap) { EXPECT_THAT(Problems(), IsEmpty()); }

TEST_F(VerifyTest, FindsNothingInAMapThatIsStillBeingBuilt) {
  const std::string path = dir_.File("half");
  auto builder = MapBuilder::Create(path, test::SmallParams(), test::SmallPlan("one", 3));
  ASSERT_TRUE(builder.ok());
  const auto problems = FindProblems(path);
  ASSERT_TRUE(problems.ok()) << problems.status();
  EXPECT_THAT(*problems, IsEmpty());
}

TEST_F(VerifyTest, ListsEverythingThatIsDamaged) {
  Sql(path_,
      "UPDATE contexts SET retrieval_key = zeroblob(16) WHERE id IN (1, 9);"
      "UPDATE places SET scan = 'x' WHERE id = 3;"
      "UPDATE places SET T_map_place = zeroblob(96) WHERE id = 4");
  EXPECT_THAT(Problems(),
              ElementsAre("place 0, polar context 1: its checksum does not match",
                          "place 2, polar context 1: its checksum does not match",
                          "place 3: its checksum does not match",
                          "place 4: the pose is not rigid: its 3×3 part is no rotation",
                          "keys of place 0: they are not those of its contexts and structure",
                          "keys of place 2: they are not those of its contexts and structure"));
}

TEST_F(VerifyTest, StopsListingWhenThereIsEnough) {
  const std::string path = dir_.File("large");
  ASSERT_TRUE(test::BuildSmallMap(path, 60).ok());
  Sql(path, "UPDATE contexts SET checksum = 0; UPDATE places SET checksum = 0");
  EXPECT_EQ(FindProblems(path)->size(), kMaxProblems);
}

TEST_F(VerifyTest, FindsDamageToTheStructureOfTheFile) {
  Sql(path_, "CREATE TABLE more (id INTEGER PRIMARY KEY, x TEXT); DROP TABLE more");
  // The dropped table left a free page; the header now says that there is none.
  std::string bytes = test::ReadFile(path_);
  std::memset(bytes.data() + 32, 0, 8);
  dir_.Write("a.scanloc", bytes);
  EXPECT_TRUE(LoadMap(path_).ok());
  EXPECT_THAT(Problems(), Contains(HasSubstr("SQLite: ")));
}

// Writes a context as a faulty builder would: with checksums that fit, but keys of other cells.
TEST_F(VerifyTest, FindsKeysThatAreNotThoseOfTheirCells) {
  ContextRow row;
  std::vector<std::int64_t> checksums;
  std::string update;
  {
    auto connection = OpenForReading(path_);
    const auto head = ReadHead(*connection);
    auto cursor = ContextCursor::Open(*connection, head->params);
    ContextValues values;
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(*cursor->Step());
      ASSERT_TRUE(cursor->Read(values).ok());
      if (i == 2) {
        ++values.retrieval_cm[0];
        Bytes retrieval_key;
        Bytes aligning_key;
        Bytes cells;
        EncodeKey(values.retrieval_cm, retrieval_key);
        EncodeKey(values.aligning_cm, aligning_key);
        EncodeCells(values.cells_cm, cells);
        row = {2, 0, 0, 2, retrieval_key, aligning_key, cells, 0};
        Hasher hasher;
        values.checksum = ContextChecksum(row, hasher);
        update = "UPDATE contexts SET retrieval_key = x'";
        for (const std::byte byte : retrieval_key) {
          absl::StrAppend(&update, absl::Hex(std::to_integer<std::uint8_t>(byte), absl::kZeroPad2));
        }
        absl::StrAppend(&update, "', checksum = ", values.checksum, " WHERE id = 2;");
      }
      checksums.push_back(values.checksum);
    }
    auto structures = StructureCursor::Open(*connection, *head);
    ASSERT_TRUE(*structures->Step());
    Structure structure;
    ASSERT_TRUE(structures->Read(structure, checksums.emplace_back()).ok());
    Hasher hasher;
    PlaceRow place;
    std::string content_id;
    const auto content = VisitPlaces(*connection, *head, [&](const PlaceRow& visited) {
      if (visited.id == 0) place = visited;
      return absl::OkStatus();
    });
    ASSERT_TRUE(content.ok());
    StartPlaceChecksum(place, hasher);
    for (const std::int64_t checksum : checksums) hasher.Add(checksum);
    absl::StrAppend(&update, "UPDATE places SET checksum = ", hasher.Digest64(), " WHERE id = 0");
  }
  Sql(path_, update);
  EXPECT_THAT(Problems(), ElementsAre(HasSubstr("place 0, context row 2: its keys are not those"),
                                      HasSubstr("content id"), HasSubstr("keys of place 0")));
}

TEST_F(VerifyTest, RefusesAMapThatNeedsANewerReader) {
  SetMeta("version", "17");
  SetMeta("compatible_version", "17");
  for (const absl::Status& status :
       {LoadMap(path_).status(), ReadInfo(path_).status(), FindProblems(path_).status(),
        MapBuilder::Append(path_, test::SmallPlan("two", 1)).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("schema version 17"));
    EXPECT_THAT(std::string(status.message()), HasSubstr("reads up to 16"));
  }
}

TEST_F(VerifyTest, ReadsANewerMapThatOldReadersCanReadButDoesNotWriteIt) {
  SetMeta("version", "17");
  // What an added table would have executed is no business of an older reader.
  Sql(path_,
      "CREATE TABLE more (id INTEGER PRIMARY KEY, x TEXT);"
      "INSERT INTO more VALUES (1, '');"
      "PRAGMA writable_schema = ON;"
      "UPDATE sqlite_schema SET sql = 'CREATE TABLE more (id INTEGER PRIMARY KEY, x TEXT, CHECK "
      "(x > ''''))' WHERE name = 'more'");
  EXPECT_TRUE(LoadMap(path_).ok());
  EXPECT_EQ(ReadInfo(path_)->schema_version, 17);
  EXPECT_THAT(Problems(), IsEmpty());
  const absl::Status status = MapBuilder::Append(path_, test::SmallPlan("two", 1)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
  for (const std::string addition :
       {"CREATE VIEW v AS SELECT id FROM places", "DROP VIEW v; CREATE INDEX i ON places (scan)"}) {
    Sql(path_, addition);
    EXPECT_EQ(LoadMap(path_).status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST_F(VerifyTest, RefusesVersionsThatAreNone) {
  for (const std::string version : {"0", "-1", "", "x", "99999999999999999999"}) {
    SetMeta("compatible_version", version);
    EXPECT_EQ(LoadMap(path_).status().code(), absl::StatusCode::kDataLoss) << version;
  }
}

// A few hundred bytes that promise ten million places must not make the reader set memory aside.
TEST_F(VerifyTest, RefusesCountsThatTheFileIsTooSmallFor) {
  const auto info = ReadInfo(path_);
  SessionRow row;
  row.name = "one";
  row.plan_hash = "x";
  row.num_scans = 10'000'000;
  row.num_places = 10'000'000;
  Sql(path_, absl::StrCat("UPDATE sessions SET plan_hash = 'x', num_scans = 10000000,",
                          " num_places = 10000000, checksum = ", SessionChecksum(0, row)));
  for (const absl::Status& status : {LoadMap(path_).status(), ReadPlaces(path_).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("too few for 10000000 places"));
  }
  row.num_scans = 10'000'001;
  row.num_places = 10'000'001;
  Sql(path_, absl::StrCat("UPDATE sessions SET plan_hash = 'x', num_scans = 10000001,",
                          " num_places = 10000001, checksum = ", SessionChecksum(0, row)));
  EXPECT_EQ(LoadMap(path_).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace scanloc::mapdb
