// What an operator may do to a running scanlocd.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "scanloc/client/client.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/raw_call.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kQueryToken[] = "a-token-that-may-query";
constexpr char kAdminToken[] = "a-token-that-may-administer";

class AdminTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(maps_);
    WriteMap("town", 1);
    tokens_ = dir_.Write("tokens", std::string("robot query ") + kQueryToken + "\noperator admin " +
                                       kAdminToken + "\n");
  }

  void WriteMap(const std::string& name, std::uint64_t seed) const {
    const std::string next = dir_.File("next");
    test::WriteSmallMap(next, seed, 4);
    std::filesystem::rename(next, PathOf(name));
  }
  [[nodiscard]] std::string PathOf(const std::string& name) const {
    return maps_ + "/" + name + ".scanloc";
  }

  void Start(bool admin = true) {
    std::vector<std::string> command = {test::BinDir() + "/scanlocd",
                                        "--maps-dir",
                                        maps_,
                                        "--token-file",
                                        tokens_,
                                        "--listen",
                                        "127.0.0.1:0"};
    if (admin) command.emplace_back("--admin");
    scanlocd_.emplace(command);
    const std::string line = scanlocd_->ReadLine();
    ASSERT_THAT(line, StartsWith("scanlocd ready on ")) << scanlocd_->stderr_text();
    address_ = line.substr(line.rfind(' ') + 1);
  }

  [[nodiscard]] client::Client As(const char* token) const {
    auto client = client::Client::Connect({.address = address_, .token = token});
    if (!client.ok()) throw std::runtime_error(client.status().ToString());
    return *std::move(client);
  }

  /// The place that a query near place 2 of the map that was made with the seed is told.
  static absl::StatusOr<int> Ask(const client::Client& client, std::uint64_t seed,
                                 const std::string& map) {
    const auto reply = client.LocalizeScan(test::QueryScan(seed, 2), {.map = map});
    if (!reply.ok()) return reply.status();
    if (reply->answer.outcome != Outcome::kLocalized) return -1;
    return reply->answer.candidates.front().place;
  }

  [[nodiscard]] grpc::health::v1::HealthCheckResponse::ServingStatus HealthOf(
      const std::string& map) const {
    const auto health = grpc::health::v1::Health::NewStub(test::ChannelTo(address_));
    grpc::ClientContext context;
    test::SetPatience(context);
    grpc::health::v1::HealthCheckRequest request;
    request.set_service("scanloc.map/" + map);
    grpc::health::v1::HealthCheckResponse response;
    EXPECT_TRUE(health->Check(&context, request, &response).ok());
    return response.status();
  }

  test::TempDir dir_;
  std::string maps_ = dir_.File("maps");
  std::string tokens_;
  std::optional<test::Process> scanlocd_;
  std::string address_;
};

TEST_F(AdminTest, IsForAdministratorsOnly) {
  Start();
  const client::Client robot = As(kQueryToken);
  EXPECT_EQ(robot.ReloadMap("town").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(robot.LoadMap("town").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(robot.UnloadMap("town").code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(As("").UnloadMap("town").code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(*Ask(robot, 1, "town"), 2);
  EXPECT_EQ(*Ask(As(kAdminToken), 1, "town"), 2) << "an administrator may query, too";
}

TEST_F(AdminTest, IsOffUnlessAskedFor) {
  Start(/*admin=*/false);
  EXPECT_EQ(As(kAdminToken).UnloadMap("town").code(), absl::StatusCode::kUnimplemented);
  const test::ProcessResult no_tokens = test::RunProcess(
      {test::BinDir() + "/scanlocd", "--maps-dir", maps_, "--admin", "--listen", "127.0.0.1:0"});
  EXPECT_EQ(no_tokens.status, 2);
  EXPECT_THAT(no_tokens.err, HasSubstr("token file"));
}

TEST_F(AdminTest, SwapsAMapWithoutDroppingAQuery) {
  Start();
  const client::Client admin = As(kAdminToken);
  std::atomic<bool> is_over = false;
  std::vector<std::thread> robots;
  for (int i = 0; i < 3; ++i) {
    robots.emplace_back([&] {
      const client::Client robot = As(kQueryToken);
      while (!is_over) {
        const auto reply = robot.LocalizeScan(test::QueryScan(1, 2));
        EXPECT_TRUE(reply.ok()) << reply.status();
      }
    });
  }
  for (std::uint64_t seed = 2; seed <= 10; ++seed) {
    WriteMap("town", seed);
    const auto map = admin.ReloadMap("town");
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_EQ(map->generation, seed);
    EXPECT_EQ(*Ask(admin, seed, "town"), 2);
  }
  is_over = true;
  for (std::thread& robot : robots) robot.join();
}

TEST_F(AdminTest, SaysWhyANewFileIsBadAndKeepsTheOldOneServing) {
  Start();
  const client::Client admin = As(kAdminToken);
  const std::string good = test::ReadFile(PathOf("town"));
  for (const std::string& bad :
       {std::string("garbage"), good.substr(0, good.size() / 2), std::string()}) {
    std::filesystem::rename(dir_.Write("next", bad), PathOf("town"));
    const absl::Status status = admin.ReloadMap("town").status();
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(std::string(status.message()), HasSubstr("map town: "));
    EXPECT_EQ(*Ask(admin, 1, "town"), 2);
    EXPECT_EQ(HealthOf("town"), grpc::health::v1::HealthCheckResponse::SERVING);
  }
  std::filesystem::remove(PathOf("town"));
  EXPECT_EQ(admin.ReloadMap("town").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(*Ask(admin, 1, "town"), 2);
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(),
              HasSubstr("[error] administration method=ReloadMap map=town by=operator"));
}

TEST_F(AdminTest, LoadsAndUnloadsMapsOfTheFolder) {
  Start();
  const client::Client admin = As(kAdminToken);
  EXPECT_EQ(admin.LoadMap("town").status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(admin.LoadMap("village").status().code(), absl::StatusCode::kNotFound);
  WriteMap("village", 2);
  const auto village = admin.LoadMap("village");
  ASSERT_TRUE(village.ok()) << village.status();
  EXPECT_EQ(village->num_places, 4);
  EXPECT_EQ(*Ask(admin, 2, "village"), 2);
  EXPECT_EQ(HealthOf("village"), grpc::health::v1::HealthCheckResponse::SERVING);
  EXPECT_EQ(admin.ListMaps()->size(), 2U);

  ASSERT_TRUE(admin.UnloadMap("village").ok());
  EXPECT_EQ(Ask(admin, 2, "village").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(HealthOf("village"), grpc::health::v1::HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(*Ask(admin, 1, ""), 2) << "the only one again";
  EXPECT_EQ(admin.ReloadMap("village").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(admin.UnloadMap("village").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(admin.LoadMap("village")->generation, 2U);
}

TEST_F(AdminTest, TakesNoPaths) {
  Start();
  const client::Client admin = As(kAdminToken);
  test::WriteSmallMap(dir_.File("outside.scanloc"), 3, 4);
  for (const std::string& name :
       {std::string("../outside"), dir_.File("outside"), std::string(".."), std::string(""),
        std::string("a\nb"), std::string("town.scanloc"), std::string(300, 'x')}) {
    EXPECT_FALSE(admin.LoadMap(name).ok()) << name;
    EXPECT_FALSE(admin.ReloadMap(name).ok()) << name;
    EXPECT_FALSE(admin.UnloadMap(name).ok()) << name;
  }
  EXPECT_EQ(admin.ListMaps()->size(), 1U);
}

TEST_F(AdminTest, TakesNoGarbage) {
  Start();
  const auto channel = test::ChannelTo(address_);
  for (const char* method : {"ReloadMap", "LoadMap", "UnloadMap"}) {
    const grpc::Status status = test::CallWithBytes(
        channel, std::string("/scanloc.v1.Admin/") + method, "\xff\xff\xff\xff\xff");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  }
  EXPECT_EQ(*Ask(As(kAdminToken), 1, "town"), 2);
}

TEST_F(AdminTest, IsThereOnTheCommandLine) {
  Start();
  const std::string token = dir_.Write("token", kAdminToken);
  const auto run = [&](const char* action, const char* map) {
    return test::RunProcess({test::BinDir() + "/scanloc", "admin", action, map, "--server",
                             address_, "--token-file", token});
  };
  WriteMap("town", 2);
  const test::ProcessResult reload = run("reload", "town");
  EXPECT_EQ(reload.status, 0) << reload.err;
  EXPECT_THAT(reload.out, HasSubstr("map town in service: 4 places"));
  EXPECT_EQ(run("unload", "town").status, 0);
  EXPECT_EQ(run("load", "town").status, 0);
  const test::ProcessResult unknown = run("load", "nowhere");
  EXPECT_EQ(unknown.status, 1);
  EXPECT_THAT(unknown.err, HasSubstr("nowhere"));
}

TEST_F(AdminTest, ServesNewFilesOfTheFolderAtHangup) {
  Start();
  const client::Client robot = As(kQueryToken);
  WriteMap("village", 2);
  scanlocd_->Signal(SIGHUP);
  while (!Ask(robot, 2, "village").ok()) std::this_thread::yield();
  EXPECT_EQ(*Ask(robot, 2, "village"), 2);
}

}  // namespace
}  // namespace scanloc::server
