#include "scanloc/client/async_client.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include "support/test_server.hpp"

namespace scanloc::client {
namespace {

/// Answers with the number of points, once the gate is open.
class CountingClient : public LocalizationClient {
 public:
  [[nodiscard]] absl::StatusOr<std::vector<MapSummary>> ListMaps() const override {
    return absl::UnimplementedError("");
  }
  [[nodiscard]] absl::StatusOr<MapInfo> GetMapInfo(const std::string&) const override {
    return absl::UnimplementedError("");
  }
  [[nodiscard]] absl::StatusOr<PlacesPage> ListPlaces(const std::string&,
                                                      const std::string&) const override {
    return absl::UnimplementedError("");
  }
  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeScan(
      PointView scan, const RequestOptions& options) const override {
    ++num_begun;
    gate.Wait();
    if (scan.empty()) return absl::InvalidArgumentError("no points");
    return LocalizeReply{.map = options.map, .queue_ns = static_cast<std::int64_t>(scan.size())};
  }
  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeDescriptor(
      const SignedDescriptor& descriptor, const RequestOptions&) const override {
    return LocalizeReply{.map = descriptor.signature};
  }
  [[nodiscard]] absl::StatusOr<RobotStream> OpenStream(const StreamOptions&) const override {
    return absl::UnimplementedError("");
  }

  mutable test::Gate gate;
  mutable std::atomic<int> num_begun = 0;
};

TEST(AsyncClient, AnswersEveryQueryFromManyThreads) {
  const auto client = std::make_shared<CountingClient>();
  client->gate.Open();
  AsyncClient async(client, 3, 200);
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([&async, robot] {
      std::vector<std::future<absl::StatusOr<LocalizeReply>>> replies;
      for (std::size_t i = 1; i <= 50; ++i) {
        replies.push_back(async.LocalizeScan(PointCloud(i), {.map = std::to_string(robot)}));
      }
      for (std::size_t i = 1; i <= 50; ++i) {
        const auto reply = replies[i - 1].get();
        ASSERT_TRUE(reply.ok());
        EXPECT_EQ(reply->queue_ns, static_cast<std::int64_t>(i));
        EXPECT_EQ(reply->map, std::to_string(robot));
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(async.LocalizeScan({}).get().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(async.LocalizeDescriptor({.signature = "s"}).get()->map, "s");
}

TEST(AsyncClient, RefusesWhatFindsNoRoomToWait) {
  const auto client = std::make_shared<CountingClient>();
  AsyncClient async(client, 1, 2);
  std::vector<std::future<absl::StatusOr<LocalizeReply>>> replies;
  replies.push_back(async.LocalizeScan(PointCloud(1)));
  while (client->num_begun == 0) std::this_thread::yield();  // no longer waits
  for (int i = 0; i < 3; ++i) replies.push_back(async.LocalizeScan(PointCloud(1)));
  EXPECT_EQ(replies[3].get().status().code(), absl::StatusCode::kResourceExhausted);
  client->gate.Open();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(replies[i].get().ok()) << i;
  EXPECT_TRUE(async.LocalizeScan(PointCloud(1)).get().ok());
}

TEST(AsyncClient, CallsBackOnce) {
  const auto client = std::make_shared<CountingClient>();
  client->gate.Open();
  std::atomic<int> num_called = 0;
  {
    AsyncClient async(client, 2);
    std::promise<void> done;
    for (int i = 0; i < 20; ++i) {
      async.LocalizeScan(PointCloud(1), {}, [&](const absl::StatusOr<LocalizeReply>& reply) {
        EXPECT_TRUE(reply.ok());
        if (++num_called == 20) done.set_value();
      });
    }
    done.get_future().wait();
  }
  EXPECT_EQ(num_called, 20);
}

TEST(AsyncClient, EndsWhatWaitsAndFinishesWhatIsUnderWay) {
  const auto client = std::make_shared<CountingClient>();
  std::vector<std::future<absl::StatusOr<LocalizeReply>>> replies;
  std::thread opener;
  {
    AsyncClient async(client, 1);
    for (int i = 0; i < 5; ++i) replies.push_back(async.LocalizeScan(PointCloud(1)));
    while (client->num_begun == 0) std::this_thread::yield();
    // Opens only when the destructor is sure to have said that it ends: the last of those that
    // wait is answered after that.
    opener = std::thread([&] { client->gate.Open(); });
    opener.join();
  }
  std::set<absl::StatusCode> codes;
  EXPECT_TRUE(replies[0].get().ok());
  for (std::size_t i = 1; i < replies.size(); ++i) codes.insert(replies[i].get().status().code());
  codes.erase(absl::StatusCode::kOk);
  codes.erase(absl::StatusCode::kCancelled);
  EXPECT_TRUE(codes.empty());
}

}  // namespace
}  // namespace scanloc::client
