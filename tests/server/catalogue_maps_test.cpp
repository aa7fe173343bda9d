// Servers that fetch their maps: real processes, a real database, a real web server.
#include <filesystem>
#include <optional>

#include "metered_scanlocd.hpp"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/postgres.hpp"
#include "support/same_answer.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class CatalogueMapsTest : public MeteredScanlocdTest {
 protected:
  void SetUp() override {
    if (!test::Postgres::IsInstalled()) GTEST_SKIP() << "PostgreSQL 15 is not installed";
    database_ = std::make_unique<test::Postgres>();
    fs::create_directories(store_folder_);
    StartStore();
  }

  void StartStore() {
    store_ = std::make_unique<test::Process>(std::vector<std::string>{
        "/usr/bin/python3", test::SourceDir() + "/tests/support/web_store.py", store_folder_});
    store_url_ = "http://127.0.0.1:" + store_->ReadLine();
  }

  void StopStore() {
    store_->Signal(SIGKILL);
    store_->Wait();
  }

  void StartWorker(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--catalogue", database_->Url(), "--store",
                                          store_url_,    "--cache-dir",    cache_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    StartMetered(arguments);
  }

  /// Puts the map of a seed in force for a region, as scanloc publish does.
  catalogue::Version Publish(const std::string& region, std::uint64_t seed,
                             const std::optional<catalogue::Area>& area = {}) {
    const std::string path = WriteMap("of-" + std::to_string(seed), seed);
    catalogue::Version version{
        .region = region,
        .content_id = mapdb::ReadInfo(path)->content_id,
        .sha256 = *catalogue::Sha256OfFile(path),
        .num_bytes = static_cast<std::int64_t>(fs::file_size(path)),
        .num_places = kNumPlaces,
        .area = area.value_or(catalogue::Area{.corners = {{1e6 * static_cast<double>(seed), 0}}})};
    EXPECT_TRUE((*catalogue::OpenStore(store_folder_))->Put(version.FileName(), path).ok());
    EXPECT_TRUE(OpenCatalogue()->Publish(version).ok());
    fs::remove(path);
    return version;
  }
  [[nodiscard]] std::unique_ptr<catalogue::Catalogue> OpenCatalogue() const {
    return *catalogue::OpenCatalogue(database_->Url());
  }

  /// The content id of the map that a region is answered from; empty where it is not answered.
  [[nodiscard]] std::string Answers(const std::string& region, std::uint64_t seed = 1) const {
    const auto reply = Connect().LocalizeScan(test::QueryScan(seed, 2), {.map = region});
    if (reply.ok()) return reply->answer.content_id;
    EXPECT_TRUE(absl::IsUnavailable(reply.status()) || absl::IsNotFound(reply.status()))
        << reply.status();
    return "";
  }
  void AwaitAnswer(const catalogue::Version& version) const {
    Await("the region is answered from its map",
          [&] { return Answers(version.region) == version.content_id; });
  }

  test::TempDir files_;
  std::string cache_ = files_.File("cache");
  std::string store_folder_ = files_.File("store");
  std::unique_ptr<test::Postgres> database_;
  std::unique_ptr<test::Process> store_;
  std::string store_url_;
};

TEST_F(CatalogueMapsTest, FetchesWhatItIsAskedFor) {
  const catalogue::Version town = Publish("town", 1);
  StartWorker();
  EXPECT_FALSE(fs::exists(cache_ + "/" + town.FileName())) << "nobody has asked";
  AwaitAnswer(town);
  const auto reply = Connect().LocalizeScan(test::QueryScan(1, 2), {.map = "town"});
  ASSERT_TRUE(reply.ok());
  const auto expected = test::LocalizerOf(*mapdb::LoadMap(cache_ + "/" + town.FileName()));
  auto describer = *Describer::Create(Params());
  test::ExpectSameAnswer(reply->answer,
                         *expected->Localize(describer.Describe(test::QueryScan(1, 2))));
  EXPECT_EQ(Connect().GetMapInfo("nowhere").status().code(), absl::StatusCode::kNotFound);
  ExpectStopsWell();
}

TEST_F(CatalogueMapsTest, IsLedToARegionByAPlaceOnEarth) {
  const auto area = [](double longitude_deg, double latitude_deg) {
    return catalogue::Area{
        .corners = catalogue::CornersOf(
            {longitude_deg, latitude_deg, longitude_deg + 0.1, latitude_deg + 0.1}),
        .is_on_earth = true};
  };
  const catalogue::Version town = Publish("town", 1, area(11.5, 48.1));
  const catalogue::Version port = Publish("port", 2, area(10.0, 53.5));
  StartWorker();
  client::RequestOptions asked;
  const auto ask = [&](double latitude_deg, double longitude_deg) {
    asked.query.prior.on_earth = Prior::GeoDisc{latitude_deg, longitude_deg, 2000.0};
    return Connect().LocalizeScan(test::QueryScan(1, 2), asked).status();
  };
  Await("the town is in service, and does not know where on earth it is", [&] {
    const absl::Status status = ask(48.21, 11.55);  // a kilometre north of it
    EXPECT_TRUE(absl::IsUnavailable(status) || absl::IsFailedPrecondition(status)) << status;
    return absl::IsFailedPrecondition(status);
  });
  EXPECT_TRUE(fs::exists(cache_ + "/" + town.FileName()));
  EXPECT_FALSE(fs::exists(cache_ + "/" + port.FileName())) << "it lies elsewhere";
  EXPECT_TRUE(absl::IsNotFound(ask(48.25, 11.55))) << "nothing lies there";
  ExpectStopsWell();
}

TEST_F(CatalogueMapsTest, FollowsWhatIsPublishedRolledBackAndWithdrawn) {
  const catalogue::Version first = Publish("town", 1);
  StartWorker();
  AwaitAnswer(first);
  const catalogue::Version second = Publish("town", 2);
  AwaitAnswer(second);
  ASSERT_TRUE(OpenCatalogue()->Rollback("town", "").ok());
  AwaitAnswer(first);
  ASSERT_TRUE(OpenCatalogue()->Withdraw("town").ok());
  const auto withdrawn = std::chrono::steady_clock::now();
  Await("it is withdrawn", [&] { return Answers("town").empty(); });
  EXPECT_LT(std::chrono::steady_clock::now() - withdrawn,
            std::chrono::seconds(10 * kSanitizerFactor));
  for (int i = 0; i < 20; ++i) EXPECT_EQ(Answers("town"), "");
  EXPECT_FALSE(fs::exists(cache_ + "/" + first.FileName()));
}

TEST_F(CatalogueMapsTest, ServesNothingThatTheStoreLiesAbout) {
  const catalogue::Version town = Publish("town", 1);
  const std::string file = store_folder_ + "/" + town.FileName();
  const std::string good = test::ReadFile(file);
  // A sound map of the same size, but another.
  const catalogue::Version other = Publish("other", 2);
  std::string lie = test::ReadFile(store_folder_ + "/" + other.FileName());
  lie.resize(good.size());
  files_.Write("store/" + town.FileName(), lie);
  StartWorker();
  EXPECT_EQ(Answers("town"), "");
  Await("the lie is told of",
        [&] { return Log().find("is not what was published") != std::string::npos; });
  EXPECT_EQ(Answers("town"), "");
  AwaitAnswer(other);
  files_.Write("store/" + town.FileName(), good);
  AwaitAnswer(town);
}

TEST_F(CatalogueMapsTest, LeavesNothingOfAFetchThatFailed) {
  const catalogue::Version town = Publish("town", 1);
  const std::string file = store_folder_ + "/" + town.FileName();
  files_.Write("store/" + town.FileName(), test::ReadFile(file) + "more");
  StartWorker();
  EXPECT_EQ(Answers("town"), "");
  Await("the fetch has failed",
        [&] { return Log().find("region town is not fetched") != std::string::npos; });
  Await("its part is gone", [&] { return !fs::exists(cache_ + "/" + town.FileName() + ".part"); });
}

TEST_F(CatalogueMapsTest, SaysWhyARegionCannotBeHad) {
  const catalogue::Version town = Publish("town", 1);
  const std::string file = store_folder_ + "/" + town.FileName();
  const std::string good = test::ReadFile(file);
  const auto await = [&](const char* why) {
    Await(why, [&] {
      const auto reply = Connect().LocalizeScan(test::QueryScan(1, 2), {.map = "town"});
      EXPECT_TRUE(absl::IsUnavailable(reply.status())) << reply.status();
      return reply.status().message().find(why) != std::string::npos;
    });
  };
  StartWorker({"--cache-bytes", std::to_string(town.num_bytes - 1)});
  await("too large");
  ExpectStopsWell();
  fs::remove(file);
  StartWorker();
  await("the store does not have it");
  files_.Write("store/" + town.FileName(), std::string(good.size(), 'x'));
  await("is not what was published");
  files_.Write("store/" + town.FileName(), good);
  AwaitAnswer(town);
}

TEST_F(CatalogueMapsTest, ServesWithoutStoreAndCatalogue) {
  const catalogue::Version town = Publish("town", 1);
  const catalogue::Version far = Publish("far", 3);
  StartWorker();
  AwaitAnswer(town);
  StopStore();
  EXPECT_EQ(Answers("town"), town.content_id);
  EXPECT_EQ(Answers("far"), "");
  database_->Stop();
  Await("the catalogue is missed",
        [&] { return Log().find("the catalogue cannot be read") != std::string::npos; });
  EXPECT_EQ(Answers("town"), town.content_id);
  ExpectStopsWell();
  StartWorker();  // with nothing but what is in its folder
  EXPECT_EQ(Answers("town"), town.content_id);
  database_->Start();
  const catalogue::Version next = Publish("town", 2);
  Await("the new version is missed",
        [&] { return Log().find("region town is not fetched") != std::string::npos; });
  EXPECT_EQ(Answers("town"), town.content_id);
}

TEST_F(CatalogueMapsTest, ComesBackAfterItWasKilledInMidFetch) {
  const catalogue::Version town = Publish("town", 1);
  files_.Write("store/slow", "");
  StartWorker();
  EXPECT_EQ(Answers("town"), "");
  const std::string part = cache_ + "/" + town.FileName() + ".part";
  Await("the fetch begins", [&] { return fs::exists(part); });
  scanlocd_->Signal(SIGKILL);
  scanlocd_->Wait();
  fs::remove(store_folder_ + "/slow");
  StartWorker();
  EXPECT_FALSE(fs::exists(part));
  AwaitAnswer(town);
}

TEST_F(CatalogueMapsTest, MakesRoomByWhatWasAskedForLongestAgo) {
  const catalogue::Version town = Publish("town", 1);
  const catalogue::Version port = Publish("port", 2);
  StartWorker({"--cache-bytes", std::to_string(town.num_bytes * 3 / 2)});
  AwaitAnswer(town);
  EXPECT_EQ(Answers("port"), "");
  AwaitAnswer(port);  // once nobody has asked for the other for a while
  EXPECT_FALSE(fs::exists(cache_ + "/" + town.FileName()));
  AwaitAnswer(town);
}

TEST_F(CatalogueMapsTest, SaysThatARegionWaitsForRoom) {
  const catalogue::Version town = Publish("town", 1);
  Publish("port", 2);
  StartWorker({"--cache-bytes", std::to_string(town.num_bytes * 3 / 2)});
  AwaitAnswer(town);
  Await("there is no room for the other", [&] {
    EXPECT_EQ(Answers("town"), town.content_id) << "it is in use";
    const auto reply = Connect().LocalizeScan(test::QueryScan(1, 2), {.map = "port"});
    EXPECT_TRUE(absl::IsUnavailable(reply.status())) << reply.status();
    return reply.status().message().find("waits for room on the server's disk") !=
           absl::string_view::npos;
  });
}

TEST_F(CatalogueMapsTest, RefusesAFolderThatIsAnothersAndACatalogueThatIsNone) {
  StartWorker();
  test::Process other(Command({"--catalogue", database_->Url(), "--store", store_url_,
                               "--cache-dir", cache_, "--listen", "127.0.0.1:0"}));
  EXPECT_EQ(other.Wait(), 1);
  EXPECT_THAT(other.stderr_text(), HasSubstr("another server's"));
  test::Process bad(Command({"--catalogue", "mysql://db", "--store", store_url_, "--cache-dir",
                             files_.File("more"), "--listen", "127.0.0.1:0"}));
  EXPECT_EQ(bad.Wait(), 1);
}

}  // namespace
}  // namespace scanloc::server
