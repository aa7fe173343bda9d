// Every catalogue: a folder, and a PostgreSQL database that the tests start.
#include "scanloc/catalogue/catalogue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "support/file_size_limit.hpp"
#include "support/postgres.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::catalogue {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

Version VersionOf(const std::string& region, char digit) {
  return {.region = region,
          .content_id = std::string(32, digit),
          .sha256 = std::string(64, digit),
          .num_bytes = 1000 + digit,
          .num_places = 7,
          .area = {.corners = {{-1.5, -2.25}, {3e6, 0.1}, {1.0 / 3.0, 7}}, .is_on_earth = false},
          .published_by = "somebody"};
}

auto IsOf(char digit) { return Field(&Version::content_id, std::string(32, digit)); }

class CatalogueTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (!GetParam()) return;
    if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
    // One for all: it takes seconds to make.
    static const test::Postgres kDatabase;  // stopped when the program ends
    database_ = &kDatabase;
    (void)database_->Sql("DROP TABLE IF EXISTS scanloc_live, scanloc_versions");
  }
  [[nodiscard]] std::unique_ptr<Catalogue> Open() const {
    auto opened = OpenCatalogue(database_ ? database_->Url() : dir_.File("catalogue"));
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  }

  test::TempDir dir_;
  const test::Postgres* database_ = nullptr;
};

TEST_P(CatalogueTest, TellsWhatIsInForceAndWhatWas) {
  const auto catalogue = Open();
  EXPECT_THAT(*catalogue->Live(), IsEmpty());
  for (const char digit : {'a', 'b'}) {
    ASSERT_TRUE(catalogue->Publish(VersionOf("town", digit)).ok());
  }
  ASSERT_TRUE(catalogue->Publish(VersionOf("port", 'c')).ok());
  const auto live = Open()->Live();
  ASSERT_TRUE(live.ok()) << live.status();
  EXPECT_THAT(*live, ElementsAre(IsOf('c'), IsOf('b')));
  Version expected = VersionOf("town", 'b');
  expected.published_ms = live->back().published_ms;
  EXPECT_EQ(live->back(), expected);
  EXPECT_GT(expected.published_ms, 1'700'000'000'000);
  EXPECT_THAT(*catalogue->History("town"), ElementsAre(IsOf('b'), IsOf('a')));
  EXPECT_THAT(*catalogue->History("nowhere"), IsEmpty());
}

TEST_P(CatalogueTest, KeepsAreasOnEarth) {
  Version version = VersionOf("town", 'a');
  version.area = {.corners = {{11.512345678901234, 48.1}, {-179.5, -89}, {0.1, 1e-300}},
                  .is_on_earth = true};
  ASSERT_TRUE(Open()->Publish(version).ok());
  ASSERT_TRUE(Open()->Publish(VersionOf("hall", 'b')).ok());
  const auto live = Open()->Live();
  ASSERT_TRUE(live.ok()) << live.status();
  EXPECT_EQ(live->front().area, VersionOf("hall", 'b').area);
  EXPECT_EQ(live->back().area, version.area);
}

TEST_P(CatalogueTest, RollsBackAndForward) {
  const auto catalogue = Open();
  EXPECT_EQ(catalogue->Rollback("town", "").status().code(), absl::StatusCode::kNotFound);
  for (const char digit : {'a', 'b', 'c'}) {
    ASSERT_TRUE(catalogue->Publish(VersionOf("town", digit)).ok());
  }
  EXPECT_THAT(*catalogue->Rollback("town", ""), IsOf('b'));
  EXPECT_THAT(*catalogue->Rollback("town", ""), IsOf('a'));
  EXPECT_EQ(catalogue->Rollback("town", "").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('a')));
  EXPECT_THAT(*catalogue->Rollback("town", std::string(32, 'c')), IsOf('c'));
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('c')));
  EXPECT_EQ(catalogue->Rollback("town", "' OR 1 = 1").status().code(), absl::StatusCode::kNotFound);
}

TEST_P(CatalogueTest, GoesBackToAnotherFileThoughThatInForceWasPublishedTwice) {
  const auto catalogue = Open();
  for (const char digit : {'a', 'b', 'b'}) {
    ASSERT_TRUE(catalogue->Publish(VersionOf("town", digit)).ok());
  }
  EXPECT_THAT(*catalogue->Rollback("town", ""), IsOf('a'));
}

TEST_P(CatalogueTest, Withdraws) {
  const auto catalogue = Open();
  ASSERT_TRUE(catalogue->Publish(VersionOf("town", 'a')).ok());
  EXPECT_TRUE(catalogue->Withdraw("town").ok());
  EXPECT_THAT(*catalogue->Live(), IsEmpty());
  EXPECT_EQ(catalogue->Withdraw("town").code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(*catalogue->Rollback("town", std::string(32, 'a')), IsOf('a'));
}

TEST_P(CatalogueTest, TakesTwoPublishersAtOnce) {
  std::vector<std::thread> publishers;
  for (const char digit : {'a', 'b', 'c', 'd'}) {
    publishers.emplace_back([&, digit] {
      const auto catalogue = Open();
      for (int i = 0; i < 5; ++i) {
        const absl::Status status = catalogue->Publish(VersionOf("town", digit));
        EXPECT_TRUE(status.ok()) << status;
      }
    });
  }
  for (std::thread& publisher : publishers) publisher.join();
  const auto history = Open()->History("town");
  ASSERT_EQ(history->size(), 20U);
  EXPECT_THAT(*Open()->Live(), ElementsAre(IsOf(history->front().content_id.front())));
}

TEST_P(CatalogueTest, SaysThatSomethingChanged) {
  const auto listener = Open();
  ASSERT_TRUE(listener->AwaitChange(std::chrono::milliseconds(1)).ok());
  std::thread publisher([&] { EXPECT_TRUE(Open()->Publish(VersionOf("town", 'a')).ok()); });
  const auto start = std::chrono::steady_clock::now();
  while (listener->Live()->empty()) {
    ASSERT_TRUE(listener->AwaitChange(std::chrono::seconds(30)).ok());
    ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(25));
  }
  publisher.join();
}

TEST_P(CatalogueTest, RefusesWhatCouldDoHarmAsAName) {
  const auto catalogue = Open();
  for (const char* region : {"", "../town", ".hidden", "a/b", "a b", "a\nb", "'; DROP TABLE x"}) {
    EXPECT_EQ(catalogue->Publish(VersionOf(region, 'a')).code(), absl::StatusCode::kInvalidArgument)
        << region;
  }
  Version version = VersionOf("town", 'a');
  version.content_id = "../../../../../../../../etc/passwd";
  EXPECT_FALSE(catalogue->Publish(version).ok());
  version = VersionOf("town", 'a');
  version.sha256.pop_back();
  EXPECT_FALSE(catalogue->Publish(version).ok());
  version = VersionOf("town", 'a');
  version.area.corners[1].x = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(catalogue->Publish(version).ok());
  EXPECT_THAT(*catalogue->Live(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Of, CatalogueTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "Postgres" : "AFolder");
});

// As versions before polygons wrote it, and read it.
TEST(FolderCatalogue, GoesOnWithOneOfBoxes) {
  const test::TempDir dir;
  dir.Write(
      "catalogue.json",
      R"({"live": {"town": 0}, "versions": [{"area": [-1.0, -2.0, 3.0, 4.0], "content_id": ")" +
          std::string(32, 'a') + R"(", "num_bytes": 7, "num_places": 7, "published_by": "x",
                "published_ms": 5, "region": "town", "sha256": ")" +
          std::string(64, 'a') + R"("}]})");
  auto catalogue = *OpenCatalogue(dir.path().string());
  auto live = catalogue->Live();
  ASSERT_TRUE(live.ok()) << live.status();
  EXPECT_EQ(live->front().area, (Area{.corners = CornersOf({-1, -2, 3, 4})}));
  ASSERT_TRUE(catalogue->Publish(VersionOf("town", 'b')).ok());
  const auto json = nlohmann::json::parse(test::ReadFile(dir.File("catalogue.json")));
  EXPECT_EQ(json["versions"][1]["area"], nlohmann::json({-1.5, -2.25, 3e6, 7.0}));
}

TEST(PostgresCatalogue, GoesOnWithADatabaseOfBefore) {
  if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
  const test::Postgres database;
  ASSERT_TRUE((*OpenCatalogue(database.Url()))->Live().ok()) << "makes the tables";
  (void)database.Sql(
      "INSERT INTO scanloc_versions (region, content_id, sha256, num_bytes, num_places, area,"
      " published_by) VALUES ('town', repeat('a', 32), repeat('a', 64), 7, 7,"
      " '((-1,-2),(3,-2),(3,4),(-1,4))', 'x');"
      "INSERT INTO scanloc_live SELECT 'town', id FROM scanloc_versions");
  auto catalogue = *OpenCatalogue(database.Url());
  auto live = catalogue->Live();
  ASSERT_TRUE(live.ok()) << live.status();
  EXPECT_EQ(live->front().area, (Area{.corners = CornersOf({-1, -2, 3, 4})}));
  Version on_earth = VersionOf("port", 'b');
  on_earth.area = {.corners = {{11.5, 48.1}}, .is_on_earth = true};
  ASSERT_TRUE(catalogue->Publish(on_earth).ok());
  live = catalogue->Live();
  ASSERT_TRUE(live.ok()) << live.status();
  EXPECT_EQ(live->front().area, on_earth.area);
  EXPECT_FALSE(live->back().area.is_on_earth);
}

TEST(FolderCatalogue, SaysThatItIsDamaged) {
  const test::TempDir dir;
  for (const char* text : {"{", "[]", R"({"versions": [], "live": {"town": 0}})",
                           R"({"versions": [{"region": "town"}], "live": {}})"}) {
    dir.Write("catalogue.json", text);
    auto catalogue = OpenCatalogue(dir.path().string());
    ASSERT_TRUE(catalogue.ok());
    EXPECT_EQ((*catalogue)->Live().status().code(), absl::StatusCode::kDataLoss) << text;
    EXPECT_FALSE((*catalogue)->Publish(VersionOf("town", 'a')).ok()) << "it would be written over";
  }
}

TEST(FolderCatalogue, StaysAsItWasWhenThereIsNoRoom) {
  const test::TempDir dir;
  auto catalogue = *OpenCatalogue(dir.path().string());
  ASSERT_TRUE(catalogue->Publish(VersionOf("town", 'a')).ok());
  absl::Status status;
  {
    const test::FileSizeLimit limit(100);
    status = catalogue->Publish(VersionOf("town", 'b'));
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(status.message(), testing::HasSubstr("File too large"));
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('a')));
}

TEST(PostgresCatalogue, ComesBackAfterTheDatabase) {
  if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
  test::Postgres database;
  auto catalogue = *OpenCatalogue(database.Url());
  ASSERT_TRUE(catalogue->Publish(VersionOf("town", 'a')).ok());
  database.Stop();
  EXPECT_EQ(catalogue->Live().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(catalogue->Live().status().message()),
              testing::HasSubstr("reached: connection to server on socket \""));
  EXPECT_EQ(catalogue->Publish(VersionOf("town", 'b')).code(), absl::StatusCode::kUnavailable);
  EXPECT_FALSE(catalogue->AwaitChange(std::chrono::milliseconds(1)).ok());
  database.Start();
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('a')));
  EXPECT_TRUE(catalogue->Publish(VersionOf("town", 'b')).ok());
}

TEST(PostgresCatalogue, WaitsNotForEverForADatabaseThatHangs) {
  if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
  test::Postgres database;
  auto catalogue = *OpenCatalogue(database.Url());
  ASSERT_TRUE(catalogue->Publish(VersionOf("town", 'a')).ok());
  // The one process of the database that serves the catalogue.
  const pid_t server = std::stoi(
      database.Sql("SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid "
                   "<> pg_backend_pid()"));
  ASSERT_EQ(kill(server, SIGSTOP), 0);
  const absl::Status status = catalogue->Publish(VersionOf("town", 'b'));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("it said nothing for 9 s"));
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('a')));  // another of its processes
  kill(server, SIGCONT);
  EXPECT_TRUE(catalogue->Publish(VersionOf("town", 'c')).ok());
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('c')));
}

// Whatever the moment: a version that is recorded and not in force, never one in force by half.
TEST(PostgresCatalogue, IsNotLeftByHalfWhenItRestartsInMidPublish) {
  if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
  test::Postgres database;
  ASSERT_TRUE((*OpenCatalogue(database.Url()))->Publish(VersionOf("town", 'a')).ok());
  // Holds up whoever publishes at its last step.
  test::Process holder({"/usr/lib/postgresql/15/bin/psql", database.Url(), "-c",
                        "BEGIN; LOCK TABLE scanloc_live; SELECT 'held', pg_sleep(60)"},
                       {.stdout_path = "/dev/null", .stderr_path = "/dev/null"});
  while (database
             .Sql("SELECT count(*) FROM pg_locks WHERE relation = 'scanloc_live'::regclass AND "
                  "mode = 'AccessExclusiveLock' AND granted")
             .front() == '0') {
    std::this_thread::yield();
  }
  std::thread publisher([&] {
    EXPECT_EQ((*OpenCatalogue(database.Url()))->Publish(VersionOf("town", 'b')).code(),
              absl::StatusCode::kUnavailable);
  });
  while (database
             .Sql("SELECT count(*) FROM pg_locks WHERE relation = 'scanloc_live'::regclass AND "
                  "NOT granted")
             .front() == '0') {
    std::this_thread::yield();
  }
  database.Stop();
  publisher.join();
  database.Start();
  const auto catalogue = *OpenCatalogue(database.Url());
  EXPECT_THAT(*catalogue->Live(), ElementsAre(IsOf('a')));
  EXPECT_THAT(*catalogue->History("town"), ElementsAre(IsOf('a')));
}

TEST(OpenCatalogue, RefusesWhatIsNone) {
  for (const char* url : {"", "mysql://db/maps", "https://db/maps"}) {
    EXPECT_EQ(OpenCatalogue(url).status().code(), absl::StatusCode::kInvalidArgument) << url;
  }
  EXPECT_EQ((*OpenCatalogue("postgresql:///none?host=/nowhere"))->Live().status().code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace scanloc::catalogue
