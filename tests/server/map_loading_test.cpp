// Maps that come, go and fail while a server runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Health = grpc::health::v1::HealthCheckResponse;

/// A server of the maps folder, whose files only say by their name which map is in them: those that
/// begin with "bad" none.
class MapLoadingTest : public testing::Test {
 protected:
  void Start() {
    Touch("town");
    StartWithWhatIsThere();
  }
  void StartWithWhatIsThere() {
    ServerOptions options;
    options.maps_dir = dir_.path();
    options.listen = "127.0.0.1:0";
    auto server = Server::Start(options, [this](const std::string& path, const Map* before) {
      before_ = before;
      return Load(path);
    });
    if (!server.ok()) throw std::runtime_error(server.status().ToString());
    server_ = *std::move(server);
  }

  void Touch(const std::string& name) const { dir_.Write(name + ".scanloc", ""); }
  void Remove(const std::string& name) const {
    std::filesystem::remove(dir_.File(name + ".scanloc"));
  }

  absl::StatusOr<Map> Load(const std::string& path) {
    const std::string name = std::filesystem::path(path).stem().string();
    if (name == "slow") {
      is_loading_slowly_.Open();
      may_go_on_.Wait();
    }
    if (name.starts_with("bad") || is_bad_) return absl::DataLossError("a made-up damage");
    return test::SmallMap(1, 2);
  }

  [[nodiscard]] Health::ServingStatus HealthOf(const std::string& map) const {
    return HealthOfService(HealthName(map));
  }
  [[nodiscard]] Health::ServingStatus HealthOfService(const std::string& service) const {
    const auto health = grpc::health::v1::Health::NewStub(test::ChannelTo(server_->address()));
    grpc::ClientContext context;
    test::SetPatience(context);
    grpc::health::v1::HealthCheckRequest request;
    request.set_service(service);
    Health response;
    const grpc::Status status = health->Check(&context, request, &response);
    return status.ok() ? response.status() : Health::SERVICE_UNKNOWN;
  }
  [[nodiscard]] MapState StateOf(const std::string& name) const {
    for (const MapSummary& map : server_->maps().List()) {
      if (map.name == name) return map.state;
    }
    throw std::runtime_error("no map " + name);
  }
  [[nodiscard]] std::string Unnamed() const {
    const auto map = server_->maps().Find("");
    return map.ok() ? (*map)->info.name : map.status().ToString();
  }

  test::TempDir dir_;
  test::Gate is_loading_slowly_;
  test::Gate may_go_on_;
  std::atomic<bool> is_bad_ = false;
  std::atomic<const Map*> before_ = nullptr;  // as the loader was told it last
  std::unique_ptr<Server> server_;
};

TEST_F(MapLoadingTest, TakesNoNameForTheGoodMapBesideABadNewFile) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  Touch("bad");
  EXPECT_EQ(server_->LoadMap("bad").code(), absl::StatusCode::kDataLoss);
  Touch("bad-too");
  server_->ReloadMaps();
  EXPECT_EQ(Unnamed(), "town");
  for (const char* bad : {"bad", "bad-too"}) {
    EXPECT_EQ(StateOf(bad), MapState::kFailed);
    EXPECT_EQ(HealthOf(bad), Health::NOT_SERVING);
    EXPECT_THAT(server_->MetricsText(),
                HasSubstr("scanloc_map_serving{map=\"" + std::string(bad) + "\"} 0\n"));
  }
  Touch("village");
  ASSERT_TRUE(server_->LoadMap("village").ok());
  EXPECT_THAT(Unnamed(), HasSubstr("this server has several"));
}

TEST_F(MapLoadingTest, ServesAsAWholeWhileAnyMapAnswers) {
  StartWithWhatIsThere();
  ASSERT_TRUE(server_->LoadMaps().ok());
  EXPECT_EQ(HealthOfService(""), Health::NOT_SERVING);
  EXPECT_THAT(Unnamed(), HasSubstr("this server has no map"));
  Touch("town");
  server_->ReloadMaps();
  EXPECT_EQ(HealthOfService(""), Health::SERVING);
  ASSERT_TRUE(server_->UnloadMap("town").ok());
  EXPECT_EQ(HealthOfService(""), Health::NOT_SERVING);
  ASSERT_TRUE(server_->LoadMap("town").ok());
  EXPECT_EQ(HealthOfService(""), Health::SERVING);
}

TEST_F(MapLoadingTest, TakesNoNameForTheGoodMapBesideABadOneAtTheStart) {
  Touch("bad");
  Start();
  EXPECT_THAT(Unnamed(), HasSubstr("this server has several")) << "it may be either, still";
  ASSERT_TRUE(server_->LoadMaps().ok());
  EXPECT_EQ(Unnamed(), "town");
}

TEST_F(MapLoadingTest, TakesNoNameForTheOldMapWhileANewOneLoads) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  Touch("slow");
  std::thread reload([&] { server_->ReloadMaps(); });
  is_loading_slowly_.Wait();
  EXPECT_EQ(Unnamed(), "town");
  may_go_on_.Open();
  reload.join();
  EXPECT_THAT(Unnamed(), HasSubstr("this server has several"));
}

TEST_F(MapLoadingTest, LoadsAndUnloadsMapsWhileAnotherTakesForEver) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  Touch("slow");
  std::thread load([&] { EXPECT_TRUE(server_->LoadMap("slow").ok()); });
  is_loading_slowly_.Wait();
  auto others = std::async(std::launch::async, [&] {
    EXPECT_TRUE(server_->ReloadMap("town").ok());
    Touch("village");
    EXPECT_TRUE(server_->LoadMap("village").ok());
    EXPECT_TRUE(server_->UnloadMap("village").ok());
  });
  EXPECT_EQ(others.wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_EQ(StateOf("slow"), MapState::kLoading);
  may_go_on_.Open();
  load.join();
  EXPECT_EQ(StateOf("slow"), MapState::kServing);
}

TEST_F(MapLoadingTest, ForgetsAMapThatFailedOnceItIsUnloadedOrItsFileIsGone) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  for (const char* bad : {"bad", "bad-too"}) {
    Touch(bad);
    EXPECT_FALSE(server_->LoadMap(bad).ok());
  }
  EXPECT_TRUE(server_->UnloadMap("bad").ok());
  Remove("bad");
  Remove("bad-too");
  Remove("town");
  server_->ReloadMaps();
  EXPECT_THAT(server_->MetricsText(), Not(HasSubstr("map_serving{map=\"bad")));
  EXPECT_EQ(server_->maps().List().size(), 1U) << "the one that serves stays";
}

TEST_F(MapLoadingTest, CountsReloadsThatFailedFromNoughtOn) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  const std::string count = "scanloc_map_reload_failures_total{map=\"town\"} ";
  EXPECT_THAT(server_->MetricsText(), HasSubstr(count + "0\n"));
  is_bad_ = true;
  EXPECT_FALSE(server_->ReloadMap("town").ok());
  server_->ReloadMaps();
  EXPECT_THAT(server_->MetricsText(), HasSubstr(count + "2\n"));
  EXPECT_EQ(HealthOf("town"), Health::SERVING);
}

TEST_F(MapLoadingTest, TellsTheLoaderWhichMapIsInService) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  EXPECT_EQ(before_, nullptr);
  const auto served = server_->maps().Find("town");
  ASSERT_TRUE(served.ok());
  ASSERT_TRUE(server_->ReloadMap("town").ok());
  EXPECT_EQ(before_, &(*served)->localizer->map());
}

TEST_F(MapLoadingTest, SaysThatAMapServesThoughALoadFindsItUnchanged) {
  Start();
  // In service, while its health has not been told yet.
  ASSERT_TRUE(server_->maps().Serve("town", dir_.File("town.scanloc"), test::SmallMap(1, 2)).ok());
  ASSERT_EQ(HealthOf("town"), Health::NOT_SERVING);
  ASSERT_TRUE(server_->ReloadMap("town").ok());
  EXPECT_EQ(HealthOf("town"), Health::SERVING);
}

TEST_F(MapLoadingTest, EndsServingWhoeverLoadsANewMapFirst) {
  Start();
  ASSERT_TRUE(server_->LoadMaps().ok());
  Touch("village");
  for (int i = 0; i < 50; ++i) {
    std::thread hangup([&] { server_->ReloadMaps(); });
    const absl::Status loaded = server_->LoadMap("village");
    hangup.join();
    EXPECT_TRUE(loaded.ok() || absl::IsAlreadyExists(loaded)) << loaded;
    ASSERT_EQ(HealthOf("village"), Health::SERVING) << i;
    ASSERT_TRUE(server_->UnloadMap("village").ok());
    ASSERT_EQ(HealthOf("village"), Health::NOT_SERVING) << i;
  }
}

}  // namespace
}  // namespace scanloc::server
