// How maps fare in use: counted, kept beside the map over a kill, and whatever lies there hurts
// nobody.
#include <filesystem>

#include "maps/use_book.hpp"
#include "nlohmann/json.hpp"
#include "scanloc/mapdb/use_file.hpp"
#include "scanlocd_fixture.hpp"
#include "support/small_map.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

Answer Localized(std::int32_t place) {
  Answer answer;
  answer.outcome = Outcome::kLocalized;
  answer.candidates.emplace_back().place = place;
  answer.candidates.front().confidence = 0.9;
  return answer;
}

constexpr std::int64_t kNumPlaces = 100;

std::int64_t NumFound(const UseCounter& counter, std::int32_t place) {
  return counter.Page(0, 0)->use.places[place].num_found;
}

class UseCounterTest : public testing::Test {
 protected:
  const test::TempDir dir_;
  const std::string file_ = dir_.File("town.health");
};

TEST_F(UseCounterTest, GoesOnFromItsFile) {
  for (int run = 1; run <= 3; ++run) {
    UseCounter counter(file_, "a", kNumPlaces);
    counter.Load();
    counter.Count(Localized(5), {}, 1);
    counter.Write();
    EXPECT_EQ(NumFound(counter, 5), run);
  }
}

TEST_F(UseCounterTest, SetsAsideWhatIsNotItsOwn) {
  for (const char* text : {"", "garbage", "scanloc-map-health 9\n"}) {
    dir_.Write("town.health", text);
    UseCounter counter(file_, "a", kNumPlaces);
    counter.Load();
    EXPECT_EQ(test::ReadFile(file_ + ".old"), text);
    counter.Count(Localized(5), {}, 1);
    counter.Write();
    EXPECT_EQ(mapdb::ReadUse(file_, kNumPlaces)->places.at(5).num_found, 1);
  }
}

TEST_F(UseCounterTest, TakesCountsUpAgainOfAMapThatComesBack) {
  {
    UseCounter first(file_, "a", kNumPlaces);
    first.Load();
    first.Count(Localized(1), {}, 1);
    first.Write();
    UseCounter second(file_, "b", kNumPlaces);
    second.Load();
    second.Count(Localized(2), {}, 1);
    second.Write();
  }
  UseCounter again(file_, "a", kNumPlaces);
  again.Load();
  EXPECT_EQ(NumFound(again, 1), 1);
  again.Write();
  EXPECT_EQ(mapdb::ReadUse(file_, kNumPlaces)->content_id, "a");
  EXPECT_EQ(mapdb::ReadUse(file_ + ".old", kNumPlaces)->content_id, "b");
}

TEST_F(UseCounterTest, LeavesTheFileToAnotherServerThatWritesIt) {
  UseCounter mine(file_, "a", kNumPlaces);
  mine.Load();
  UseCounter other(file_, "a", kNumPlaces);
  other.Load();
  other.Count(Localized(1), {}, 1);
  other.Write();
  mine.Count(Localized(2), {}, 1);
  mine.Write();
  EXPECT_EQ(mapdb::ReadUse(file_, kNumPlaces)->places.count(2), 0U);
  other.Count(Localized(1), {}, 1);
  other.Write();
  EXPECT_EQ(mapdb::ReadUse(file_, kNumPlaces)->places.at(1).num_found, 2);
  EXPECT_EQ(NumFound(mine, 2), 1) << "it is counted, all the same";
}

TEST_F(UseCounterTest, WritesAgainOnceItCan) {
  UseCounter counter(file_, "a", kNumPlaces);
  counter.Load();
  counter.Count(Localized(1), {}, 1);
  fs::create_directory(file_ + ".part");
  counter.Write();
  EXPECT_FALSE(fs::exists(file_));
  fs::remove(file_ + ".part");
  counter.Write();
  EXPECT_EQ(mapdb::ReadUse(file_, kNumPlaces)->places.at(1).num_found, 1);
}

TEST_F(UseCounterTest, SharesOneCounterAmongNamesOfOneMap) {
  UseBook book(std::chrono::hours(1));
  const auto one = book.Open(dir_.File("map"), "a", kNumPlaces);
  EXPECT_EQ(book.Open(dir_.File("map"), "a", kNumPlaces), one);
  one->Count(Localized(3), {}, 1);
  const auto next = book.Open(dir_.File("map"), "b", kNumPlaces);
  EXPECT_NE(next, one);
  one->Count(Localized(3), {}, 2);  // by a query that was under way
  next->Count(Localized(4), {}, 3);
  book.Stop();
  EXPECT_EQ(mapdb::ReadUse(dir_.File("map.health"), kNumPlaces)->content_id, "b");
  EXPECT_EQ(mapdb::ReadUse(dir_.File("map.health.old"), kNumPlaces)->content_id, "a");
  EXPECT_EQ(UseBook(std::chrono::seconds(0)).Open(dir_.File("map"), "a", kNumPlaces), nullptr);
}

class MapHealthTest : public ScanlocdTest {
 protected:
  void StartCounting(const std::string& seconds = "0.02") {
    Start({"--map", "town=" + map_, "--map-health-seconds", seconds});
  }
  void Ask(int place) const {
    const auto reply = Connect().LocalizeScan(test::QueryScan(1, place));
    ASSERT_TRUE(reply.ok()) << reply.status();
    ASSERT_EQ(reply->answer.outcome, Outcome::kLocalized);
  }
  [[nodiscard]] std::int64_t NumLocalized() const {
    return Connect().GetMapUse("town")->num_localized;
  }
  /// Until the file tells of so many.
  void AwaitFile(std::int64_t num_localized) const {
    while (true) {
      const auto use = mapdb::ReadUse(file_, kNumPlaces);
      if (use.ok() && use->num_localized == num_localized) return;
      std::this_thread::yield();
    }
  }

  const std::string map_ = WriteMap("town", 1);
  const std::string file_ = map_ + ".health";
};

TEST_F(MapHealthTest, KeepsItsCountsOverAKillAndAnEnd) {
  StartCounting();
  Ask(2);
  Ask(2);
  Ask(3);
  AwaitFile(3);
  scanlocd_->Signal(SIGKILL);
  scanlocd_->Wait();
  StartCounting("3600");
  EXPECT_EQ(NumLocalized(), 3);
  Ask(2);
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  const auto use = mapdb::ReadUse(file_, kNumPlaces);
  ASSERT_TRUE(use.ok()) << use.status();
  EXPECT_EQ(use->num_localized, 4);
  EXPECT_EQ(use->places.at(2).num_found, 3);
  EXPECT_GT(use->places.at(2).confidence, 0.5);

  const test::ProcessResult told =
      test::RunProcess({test::BinDir() + "/scanloc", "info", map_, "--health"});
  EXPECT_EQ(told.status, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("4 localized"));
  const test::ProcessResult as_json =
      test::RunProcess({test::BinDir() + "/scanloc", "info", map_, "--health", "--json"});
  EXPECT_EQ(nlohmann::json::parse(as_json.out).at("places")[0].at("num_found"), 3);
  // Of another map it tells nothing, and the server says the same as the file.
  EXPECT_EQ(
      test::RunProcess({test::BinDir() + "/scanloc", "info", WriteMap("other", 2), "--health"})
          .status,
      1);
  StartCounting();
  const test::ProcessResult by_server =
      test::RunProcess({test::BinDir() + "/scanloc", "info", "--server", address_, "--map", "town",
                        "--health", "--json"});
  EXPECT_EQ(by_server.out, as_json.out) << by_server.err;
}

TEST_F(MapHealthTest, ServesWhateverLiesThere) {
  dir_.Write("town.scanloc.health", std::string(1000, '\0'));
  StartCounting();
  Ask(2);
  AwaitFile(1);
  EXPECT_EQ(fs::file_size(file_ + ".old"), 1000U);
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("is set aside as"));
}

TEST_F(MapHealthTest, CountsNothingWhereItMayNot) {
  StartCounting("0");
  Ask(2);
  EXPECT_EQ(Connect().GetMapUse("town").status().code(), absl::StatusCode::kUnimplemented);
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_FALSE(fs::exists(file_));
}

TEST_F(MapHealthTest, SaysWhereItCannotWriteAndGoesOn) {
  fs::create_directory(file_ + ".part");
  StartCounting();
  Ask(2);
  EXPECT_EQ(NumLocalized(), 1);
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("not kept over a restart"));
}

}  // namespace
}  // namespace scanloc::server
