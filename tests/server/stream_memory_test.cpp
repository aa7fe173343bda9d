// What the scans of streams may hold of the server's memory.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "scanloc/client/client.hpp"
#include "support/scenes.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

// What waits in streams is no other client's loss.
TEST(RobotStream, OfManyLargeScansShutsNobodyOut) {
  const test::Maps maps = {{"town", test::SmallMap(1, 6)}};
  ServerOptions options = test::OptionsFor(maps);
  options.num_threads = 1;
  options.max_memory_bytes = 128 << 20;  // of which gRPC needs some for itself
  const auto server = test::StartServer(maps, options);
  const auto client =
      client::Client::Connect({.address = server->address(), .timeout = std::chrono::minutes(2)});
  ASSERT_TRUE(client.ok()) << client.status();
  const PointCloud large = scenes::RandomScan(1, 300'000);  // 3.6 MB
  std::atomic<int> num_busy = 20;
  std::vector<std::thread> robots;
  for (int i = num_busy; i > 0; --i) {
    robots.emplace_back([&] {
      auto stream = client->OpenStream({.send_descriptor = false});
      EXPECT_TRUE(stream.ok()) << stream.status();
      for (int scan = 0; stream.ok() && scan < 2; ++scan) {
        const auto told = stream->Locate(large);
        EXPECT_TRUE(told.ok()) << told.status();
      }
      --num_busy;
    });
  }
  while (num_busy > 0) {
    const absl::Status status = client->LocalizeScan(test::QueryScan(1, 2)).status();
    EXPECT_TRUE(status.ok()) << status;
  }
  for (std::thread& robot : robots) robot.join();
}

}  // namespace
}  // namespace scanloc::server
