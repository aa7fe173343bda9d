// Maps whose contexts and structures stay in their file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "checksum.hpp"
#include "encoding.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/same_answer.hpp"
#include "support/scenes.hpp"
#include "support/small_maps.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;

constexpr std::size_t kNumPlaces = 24;

SessionPlan Plan(const std::string& name, std::size_t num_scans) {
  SessionPlan plan = test::SmallPlan(name, num_scans);
  for (std::size_t i = 0; i < num_scans; ++i) {
    plan.scans[i].T_map_place = PlanarOffset(0.0, 0.3 * static_cast<double>(i));
    plan.scans[i].T_map_place.translation().x() = 15.0 * static_cast<double>(i);
  }
  return plan;
}

PointCloud Scene(std::size_t scan) { return scenes::PostScan(100 + scan, 70); }

/// A map that `auto` can answer from, and its file.
class OpenMapTest : public testing::Test {
 protected:
  void SetUp() override { Build(path_, 100, Params()); }

  static void Build(const std::string& path, std::size_t seed, const Params& params) {
    BuildOptions options = test::SmallOptions(path);
    options.params = params;
    const auto load = [&](std::size_t i) -> absl::StatusOr<PointCloud> {
      return scenes::PostScan(seed + i, 70);
    };
    ASSERT_TRUE(BuildMap(options, Plan("one", kNumPlaces), load).ok());
  }

  static std::shared_ptr<const Localizer> LocalizerOf(absl::StatusOr<Map> map) {
    EXPECT_TRUE(map.ok()) << map.status();
    return *Localizer::Create(std::make_shared<const Map>(*std::move(map)));
  }

  static ScanDescriptor Seen(std::size_t place) {
    return Describer::Create(Params())->Describe(
        scenes::SeenFrom(Scene(place), PlanarOffset(0.3, 0.5)));
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(OpenMapTest, AnswersAsInMemoryOnAnyNumberOfThreads) {
  const auto in_memory = LocalizerOf(LoadMap(path_));
  // One reader for four threads, and a cache that holds next to nothing.
  for (const OpenOptions& options :
       {OpenOptions{MakePayloadCache(1 << 30)}, OpenOptions{MakePayloadCache(20'000), 0, 1},
        OpenOptions{nullptr, 0, 3}}) {
    const auto opened = LocalizerOf(OpenMap(path_, options));
    EXPECT_TRUE(opened->map().structures.empty());
    EXPECT_FALSE(opened->map().polar.holds_contexts());
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        for (const char* method : {"auto", "a-pc", "a-cc", "pc-brute"}) {
          const Query query{.method = *ParseMethod(method), .num_candidates = 10, .max_answers = 3};
          for (std::size_t place = static_cast<std::size_t>(t); place < kNumPlaces; place += 5) {
            const ScanDescriptor scan = Seen(place);
            const auto answer = opened->Localize(scan, query);
            ASSERT_TRUE(answer.ok()) << answer.status();
            test::ExpectSameAnswer(*answer, *in_memory->Localize(scan, query));
          }
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
}

TEST_F(OpenMapTest, LoadsASmallFileAsAWhole) {
  const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(path_));
  EXPECT_EQ(OpenMap(path_, {.whole_bytes = bytes})->payload, nullptr);
  EXPECT_NE(OpenMap(path_, {.whole_bytes = bytes - 1})->payload, nullptr);
}

TEST_F(OpenMapTest, OpensMapsWithoutSomeOfTheParts) {
  for (int without = 0; without < 3; ++without) {
    Params params;
    params.polar.enabled = without != 0;
    params.cart.enabled = without != 1;
    params.cart.double_flip = false;
    params.structure.enabled = without != 2;
    const std::string path = dir_.File(absl::StrCat(without, ".scanloc"));
    Build(path, 100, params);
    const auto in_memory = LocalizerOf(LoadMap(path));
    const auto opened = LocalizerOf(OpenMap(path));
    const ScanDescriptor scan =
        Describer::Create(params)->Describe(scenes::SeenFrom(Scene(3), PlanarOffset(0.3, 0.5)));
    test::ExpectSameAnswer(*opened->Localize(scan), *in_memory->Localize(scan));
    EXPECT_TRUE(opened->map().payload->Scrub([](std::size_t) { return true; }).ok());
  }
}

TEST_F(OpenMapTest, GoesOnWhileTheFileIsAppendedToReplacedOrRemoved) {
  const auto opened = LocalizerOf(OpenMap(path_));
  const Answer expected = *opened->Localize(Seen(5));
  BuildOptions options = test::SmallOptions(path_, BuildMode::kAppend);
  const auto load = [](std::size_t i) -> absl::StatusOr<PointCloud> { return Scene(50 + i); };
  ASSERT_TRUE(BuildMap(options, Plan("two", 40), load).ok());
  test::ExpectSameAnswer(*opened->Localize(Seen(5)), expected);
  Build(dir_.File("b.scanloc"), 700, Params());
  std::filesystem::rename(dir_.File("b.scanloc"), path_);
  test::ExpectSameAnswer(*opened->Localize(Seen(5)), expected);
  std::filesystem::remove(path_);
  test::ExpectSameAnswer(*opened->Localize(Seen(5)), expected);
  EXPECT_TRUE(opened->map().payload->Scrub([](std::size_t) { return true; }).ok());
}

// Sound in itself, with all its checksums, but another map.
TEST_F(OpenMapTest, HasNoJournalRemovedThatItCannotLookAt) {
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none_left = before;
  none_left.rlim_cur = 3;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_left), 0);
  const absl::Status status = OpenMap(path_).status();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_THAT(status.message(), testing::HasSubstr("limit of open files"));
  EXPECT_THAT(status.message(), testing::Not(testing::HasSubstr("remove")));
}

TEST_F(OpenMapTest, RefusesWhatWasWrittenOverItInPlace) {
  const auto opened = LocalizerOf(OpenMap(path_));
  Build(dir_.File("b.scanloc"), 700, Params());
  dir_.Write("a.scanloc", test::ReadFile(dir_.File("b.scanloc")));
  ASSERT_TRUE(FindProblems(path_)->empty());
  EXPECT_EQ(opened->Localize(Seen(5)).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(opened->map().payload->Scrub([](std::size_t) { return true; }).code(),
            absl::StatusCode::kDataLoss);
}

TEST_F(OpenMapTest, RefusesATruncatedFile) {
  const auto opened = LocalizerOf(OpenMap(path_));
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) / 2 / 8192 * 8192);
  EXPECT_EQ(opened->map().payload->Scrub([](std::size_t) { return true; }).code(),
            absl::StatusCode::kDataLoss);
  int num_answered = 0;
  for (std::size_t place = 0; place < kNumPlaces; ++place) {
    const auto answer = opened->Localize(Seen(place));
    num_answered += answer.ok() ? 1 : 0;
    EXPECT_TRUE(answer.ok() || absl::IsDataLoss(answer.status()));
  }
  EXPECT_EQ(num_answered, 0);
}

/// What is damaged after the map was opened, and before.
struct Damage {
  std::string sql;
  std::string problem;
  bool is_in_keys = false;
};

TEST_F(OpenMapTest, TellsDamageWhenItIsReadAndWhenItIsScrubbed) {
  const std::string good = test::ReadFile(path_);
  for (const auto& [sql, problem, is_in_keys] : std::vector<Damage>{
           {"UPDATE contexts SET cells = zeroblob(20) WHERE place = 5", "checksum"},
           {"UPDATE contexts SET aligning_key = zeroblob(240) WHERE place = 5", "checksum"},
           {"UPDATE structures SET roll_rad = 0.25 WHERE place = 5", "checksum"},
           {"UPDATE structures SET posts = zeroblob(4) WHERE place = 5", "checksum"},
           {"DELETE FROM structures WHERE place = 5", "missing"},
           {"DELETE FROM contexts WHERE place = 5", "missing"},
           {"UPDATE keys SET num_posts = 0 WHERE place = 5", "checksum", true},
           {"DELETE FROM keys WHERE place = 5", "keys", true},
           {"UPDATE bearings SET rings = zeroblob(120) WHERE place = 5", "checksum", true},
           {"DELETE FROM bearings WHERE place = 5", "bearings of place 5", true},
       }) {
    dir_.Write("a.scanloc", good);
    const auto opened = LocalizerOf(OpenMap(path_));
    test::Sql(path_, sql);
    const absl::Status scrubbed = opened->map().payload->Scrub([](std::size_t) { return true; });
    EXPECT_EQ(scrubbed.code(), absl::StatusCode::kDataLoss) << sql;
    EXPECT_THAT(std::string(scrubbed.message()), HasSubstr(problem)) << sql;
    EXPECT_FALSE(FindProblems(path_)->empty()) << sql;
    // Contexts are read by the paper's methods, structures by auto.
    const bool is_in_contexts = sql.find("contexts") != std::string::npos;
    const auto answer = opened->Localize(Seen(5), {.method = Method{.automatic = !is_in_contexts}});
    EXPECT_EQ(answer.ok(), is_in_keys) << sql << answer.status();
    EXPECT_TRUE(answer.ok() || absl::IsDataLoss(answer.status())) << sql;
    EXPECT_EQ(OpenMap(path_).ok(), !is_in_keys) << sql;
  }
}

// Keys with the right checksum that are not those of their contexts.
TEST_F(OpenMapTest, ScrubComparesKeysWithContexts) {
  test::Sql(path_,
            "UPDATE keys SET retrieval_keys = (SELECT retrieval_keys FROM keys WHERE place "
            "= 6) WHERE place = 5");
  KeysRow row{.place = 5};
  std::vector<std::byte> keys;
  std::vector<std::byte> checksums;
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path_.c_str(), &database), SQLITE_OK);
  sqlite3_stmt* select = nullptr;
  sqlite3_prepare_v2(database,
                     "SELECT roll_rad, pitch_rad, height_m, num_posts, retrieval_keys, checksums "
                     "FROM keys WHERE place = 5",
                     -1, &select, nullptr);
  ASSERT_EQ(sqlite3_step(select), SQLITE_ROW);
  row.roll_rad = sqlite3_column_double(select, 0);
  row.pitch_rad = sqlite3_column_double(select, 1);
  row.height_m = sqlite3_column_double(select, 2);
  row.num_posts = sqlite3_column_int64(select, 3);
  const auto blob = [&](int column) {
    const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(select, column));
    return std::vector<std::byte>(data, data + sqlite3_column_bytes(select, column));
  };
  keys = blob(4);
  checksums = blob(5);
  sqlite3_finalize(select);
  sqlite3_close(database);
  row.retrieval_keys = keys;
  row.checksums = checksums;
  Hasher hasher;
  test::Sql(path_, absl::StrCat("UPDATE keys SET checksum = ", KeysChecksum(row, hasher),
                                " WHERE place = 5"));
  const auto opened = OpenMap(path_);
  ASSERT_TRUE(opened.ok()) << opened.status();
  const absl::Status scrubbed = opened->payload->Scrub([](std::size_t) { return true; });
  EXPECT_THAT(std::string(scrubbed.message()), HasSubstr("keys of place 5"));
  EXPECT_THAT(*FindProblems(path_), testing::ElementsAre(HasSubstr("keys of place 5")));
}

/// Gives place 5 of a map these rings, with the right checksum.
void WriteRings(const std::string& path, const Bytes& rings) {
  const absl::string_view text(reinterpret_cast<const char*>(rings.data()), rings.size());
  Hasher hasher;
  test::Sql(path, absl::StrCat("UPDATE bearings SET rings = X'", absl::BytesToHexString(text),
                               "', checksum = ", BearingsChecksum({5, rings}, hasher),
                               " WHERE place = 5"));
}

TEST_F(OpenMapTest, ScrubComparesBearingsWithStructures) {
  Bytes rings;
  EncodeBearings(LoadMap(path_)->bearings[6], rings);
  WriteRings(path_, rings);
  const auto opened = OpenMap(path_);
  ASSERT_TRUE(opened.ok()) << opened.status();
  const absl::Status scrubbed = opened->payload->Scrub([](std::size_t) { return true; });
  EXPECT_THAT(std::string(scrubbed.message()), HasSubstr("bearings of place 5"));
  EXPECT_THAT(*FindProblems(path_), testing::ElementsAre(HasSubstr("bearings of place 5")));
}

TEST_F(OpenMapTest, RefusesBearingsThatAreNone) {
  for (const std::size_t size : {0U, 8U, 119U, 121U, 128U}) {
    WriteRings(path_, Bytes(size));
    const absl::Status status = OpenMap(path_).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << size;
    EXPECT_THAT(std::string(status.message()), HasSubstr("bearings of place 5")) << size;
    EXPECT_FALSE(FindProblems(path_)->empty()) << size;
  }
}

TEST_F(OpenMapTest, RefusesMoreBearingsThanPlaces) {
  test::Sql(path_, "INSERT INTO bearings SELECT 24, checksum, rings FROM bearings WHERE place = 5");
  EXPECT_EQ(OpenMap(path_).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(FindProblems(path_)->empty());
}

TEST_F(OpenMapTest, ScrubTellsHowFarItIsAndCanBeStopped) {
  const auto map = OpenMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  std::size_t last = 0;
  EXPECT_TRUE(map->payload
                  ->Scrub([&](std::size_t num_done) {
                    EXPECT_GT(num_done, last);
                    last = num_done;
                    return true;
                  })
                  .ok());
  EXPECT_EQ(last, kNumPlaces);
  EXPECT_EQ(map->payload->Scrub([](std::size_t) { return false; }).code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace scanloc::mapdb
