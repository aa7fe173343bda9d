#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "scanloc/client/client.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanlocd_fixture.hpp"
#include "support/open_watch.hpp"
#include "support/raw_call.hpp"
#include "support/same_answer.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(ScanlocdTest, AnswersFromItsFilesAsALocalizerDoes) {
  const std::string north = WriteMap("north", 1);
  const std::string south = WriteMap("south", 2);
  Start({"--map", "north=" + north, "--map", "south=" + south});
  const auto client = client::Client::Connect({.address = address_});
  ASSERT_TRUE(client.ok()) << client.status();
  auto describer = Describer::Create(Params()).value();
  for (const auto& [name, path, seed] :
       {std::tuple("north", north, 1), std::tuple("south", south, 2)}) {
    const auto localizer = test::LocalizerOf(mapdb::LoadMap(path).value());
    for (int place = 0; place < kNumPlaces; ++place) {
      const PointCloud scan = test::QueryScan(seed, place);
      client::RequestOptions options;
      options.map = name;
      options.query.max_answers = 2;
      options.query.num_candidates = 3;
      const Answer expected = localizer->Localize(describer.Describe(scan), options.query).value();
      const auto by_scan = client->LocalizeScan(scan, options);
      ASSERT_TRUE(by_scan.ok()) << by_scan.status();
      test::ExpectSameAnswer(by_scan->answer, expected);
      const auto by_descriptor = client->LocalizeByDescriptor(scan, options);
      ASSERT_TRUE(by_descriptor.ok()) << by_descriptor.status();
      test::ExpectSameAnswer(by_descriptor->answer, expected);
    }
  }
}

TEST_F(ScanlocdTest, HeedsSignalsThatComeBeforeItServes) {
  const std::string config = dir_.Write("config", std::string(900'000, '\n'));  // takes a moment
  const std::vector<std::string> command = Command(
      {"--config", config, "--map", "town=" + WriteMap("town", 1), "--listen", "127.0.0.1:0"});
  for (const int signal : {SIGHUP, SIGTERM}) {
    const test::OpenWatch opened(config);
    scanlocd_.emplace(command);
    opened.Await();
    scanlocd_->Signal(signal);
    if (signal == SIGHUP) {
      EXPECT_THAT(scanlocd_->ReadLine(), StartsWith("scanlocd ready on"));
      scanlocd_->Signal(SIGTERM);
    }
    EXPECT_EQ(scanlocd_->Wait(), 0) << scanlocd_->stderr_text();
  }
}

TEST_F(ScanlocdTest, SaysWhichFilesOfAFolderItCannotServeByTheirNames) {
  for (const char* name : {"town", "old town", "new\ntown"}) std::ignore = WriteMap(name, 1);
  Start({"--maps-dir", dir_.path().string()});
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("old town.scanloc is not served: map name"));
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("new\\ntown.scanloc is not served: map name"));
}

TEST_F(ScanlocdTest, PrintsOneLineAndEndsWithZeroWhenSignalled) {
  const std::string map = WriteMap("town", 1);
  for (const int signal : {SIGTERM, SIGINT}) {
    Start({"--map", "town=" + map, "--log-level", "warn"});
    scanlocd_->Signal(signal);
    EXPECT_EQ(scanlocd_->Wait(), 0);
    EXPECT_EQ(scanlocd_->rest_of_stdout(), "");
    EXPECT_EQ(scanlocd_->stderr_text(), "");
  }
}

TEST_F(ScanlocdTest, ServesHealthOfEveryMapOnceReady) {
  Start({"--map", "town=" + WriteMap("town", 1)});
  const auto health = grpc::health::v1::Health::NewStub(test::ChannelTo(address_));
  for (const char* service : {"", "scanloc.map/town"}) {
    grpc::ClientContext context;
    test::SetPatience(context);
    grpc::health::v1::HealthCheckRequest request;
    request.set_service(service);
    grpc::health::v1::HealthCheckResponse response;
    ASSERT_TRUE(health->Check(&context, request, &response).ok());
    EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::SERVING);
  }
}

TEST_F(ScanlocdTest, EndsWithZeroWhenStoppedUnderLoad) {
  Start({"--map", "town=" + WriteMap("town", 1)});
  std::atomic<int> num_answered = 0;
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([&] {
      const auto client = client::Client::Connect({.address = address_});
      ASSERT_TRUE(client.ok()) << client.status();
      while (true) {
        const auto reply = client->LocalizeScan(test::QueryScan(1, 2));
        if (!reply.ok()) {
          EXPECT_EQ(reply.status().code(), absl::StatusCode::kUnavailable) << reply.status();
          return;
        }
        ++num_answered;
      }
    });
  }
  while (num_answered < 100) std::this_thread::yield();
  scanlocd_->Signal(SIGTERM);
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(scanlocd_->Wait(), 0) << scanlocd_->stderr_text();
}

TEST_F(ScanlocdTest, SaysInOneLineWhyNoMapCanBeServed) {
  const std::string torn = WriteMap("torn", 2);
  std::filesystem::resize_file(torn, std::filesystem::file_size(torn) / 2);
  for (const std::string& bad :
       {torn, dir_.File("absent.scanloc"), dir_.Write("text.scanloc", "not a map")}) {
    test::Process scanlocd(Command({"--map", "bad=" + bad, "--listen", "127.0.0.1:0"}));
    EXPECT_EQ(scanlocd.Wait(), 1);
    EXPECT_EQ(scanlocd.rest_of_stdout(), "");
    EXPECT_THAT(scanlocd.stderr_text(), StartsWith("scanlocd: map bad: "));
    EXPECT_THAT(scanlocd.stderr_text(), HasSubstr(bad));
    EXPECT_EQ(std::count(scanlocd.stderr_text().begin(), scanlocd.stderr_text().end(), '\n'), 1)
        << scanlocd.stderr_text();
  }
}

TEST_F(ScanlocdTest, ServesTheGoodMapsBesideABadOneUntilThatIsMended) {
  const std::string good = WriteMap("good", 1);
  const std::string bad = dir_.Write("bad.scanloc", "not a map");
  Start({"--map", "bad=" + bad, "--map", "good=" + good});
  const client::Client client = Connect();
  EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2), {.map = "good"}).ok());
  const absl::Status refused = client.LocalizeScan(test::QueryScan(1, 2), {.map = "bad"}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnavailable) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("could not be loaded"));
  EXPECT_EQ(std::string(refused.message()).find(bad), std::string::npos);
  EXPECT_EQ(client.ListMaps()->front().state, MapState::kFailed);

  std::filesystem::remove(bad);
  std::filesystem::copy_file(good, bad);
  ReloadAndAwait(client, "bad", 1);
  EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2), {.map = "bad"}).ok());
}

TEST_F(ScanlocdTest, TakesUpANewMapAtHangupWithoutDroppingAQuery) {
  const std::string path = WriteMap("town", 1);
  const std::string next = WriteMap("next", 2);
  Start({"--map", "town=" + path});
  const client::Client client = Connect();
  const std::string first_id = client.GetMapInfo("town")->content_id;

  std::atomic<bool> is_over = false;
  std::atomic<int> num_answered = 0;
  std::vector<std::thread> robots;
  for (int i = 0; i < 3; ++i) {
    robots.emplace_back([&] {
      while (!is_over) {
        const auto reply = client.LocalizeScan(test::QueryScan(1, 2));
        EXPECT_TRUE(reply.ok()) << reply.status();
        ++num_answered;
      }
    });
  }
  while (num_answered < 10) std::this_thread::yield();
  std::filesystem::rename(next, path);
  ReloadAndAwait(client, "town", 2);
  const int answered_by_then = num_answered;
  while (num_answered < answered_by_then + 10) std::this_thread::yield();
  is_over = true;
  for (std::thread& robot : robots) robot.join();
  EXPECT_NE(client.GetMapInfo("town")->content_id, first_id);
  const auto reply = client.LocalizeScan(test::QueryScan(2, 3));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->answer.candidates.front().place, 3);
}

TEST_F(ScanlocdTest, KeepsTheMapInServiceWhenTheNewFileIsBadOrGone) {
  const std::string path = WriteMap("town", 1);
  const std::string other = WriteMap("other", 2);
  Start({"--map", "town=" + path, "--map", "other=" + other});
  const client::Client client = Connect();
  const std::string content_id = client.GetMapInfo("town")->content_id;
  std::uint64_t generation = 1;
  for (const char* bytes : {"garbage", ""}) {
    std::filesystem::remove(path);
    if (*bytes != '\0') dir_.Write("town.scanloc", bytes);
    // The other map is loaded behind this one: once it is new, this one was tried.
    const std::string fresh = WriteMap("fresh", 10 + generation);
    std::filesystem::rename(fresh, other);
    ReloadAndAwait(client, "other", ++generation);
    EXPECT_EQ(client.GetMapInfo("town")->content_id, content_id);
    EXPECT_EQ(client.GetMapInfo("town")->generation, 1U);
    EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2), {.map = "town"}).ok());
  }
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("not reloaded: map town: "));
}

TEST_F(ScanlocdTest, SaysInOneLineThatItCannotListen) {
  const std::string map = WriteMap("town", 1);
  Start({"--map", "town=" + map});
  test::Process second(Command({"--map", "town=" + map, "--listen", address_}));
  EXPECT_EQ(second.Wait(), 1);
  EXPECT_THAT(second.stderr_text(), StartsWith("scanlocd: cannot listen on " + address_));
  EXPECT_EQ(std::count(second.stderr_text().begin(), second.stderr_text().end(), '\n'), 1)
      << second.stderr_text();
}

TEST_F(ScanlocdTest, EndsWithTwoAtWrongUsage) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"--map", "town"},
      {"--map", "town=a", "--map", "town=b"},
      {"--map", "to wn=a"},
      {"--map", "town=a", "--listen", "nowhere"},
      {"--map", "town=a", "--threads", "-1"},
      {"--map", "town=a", "--max-inflight", "none"},
      {"--map", "town=a", "--drain-seconds", "nan"},
      {"--map", "town=a", "--token-file", ""},
      {"--map", "town=a", "--tls-client-ca", ""},
      {"--map", "town=a", "--max-rate", ""},
      {"--map", "town=a", "--config", ""},
      {"--map", "town=a", "--log-level", "loud"},
      {"--map", "town=a", "--what"}};
  for (const auto& arguments : wrong) {
    test::Process scanlocd(Command(arguments));
    EXPECT_EQ(scanlocd.Wait(), 2) << testing::PrintToString(arguments);
    EXPECT_NE(scanlocd.stderr_text(), "") << testing::PrintToString(arguments);
  }
}

TEST_F(ScanlocdTest, HelpsAndTellsItsVersion) {
  test::Process help(Command({"--help"}));
  EXPECT_EQ(help.Wait(), 0);
  EXPECT_THAT(help.rest_of_stdout(), HasSubstr("--max-inflight"));
  EXPECT_THAT(help.rest_of_stdout(), HasSubstr("{none,failed,all}"));
  EXPECT_THAT(help.rest_of_stdout(), Not(HasSubstr("ENUM")));
  test::Process version(Command({"--version"}));
  EXPECT_EQ(version.Wait(), 0);
  EXPECT_THAT(version.rest_of_stdout(), StartsWith("scanlocd "));
}

}  // namespace
}  // namespace scanloc::server
