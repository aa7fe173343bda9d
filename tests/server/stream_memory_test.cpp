// What the scans of streams may hold of the server's memory.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "metered_scanlocd.hpp"
#include "scanloc/client/client.hpp"
#include "support/long_tests.hpp"
#include "support/scenes.hpp"
#include "support/small_map.hpp"

namespace scanloc::server {
namespace {

/// In a process of its own: what the clients hold is none of the server's memory.
using StreamMemoryTest = MeteredScanlocdTest;

// What waits in streams is no other client's loss.
TEST_F(StreamMemoryTest, OfManyLargeScansShutsNobodyOut) {
  if (!test::LongTests()) GTEST_SKIP() << "needs the machine for itself: SCANLOC_LONG_TESTS=1";
  StartMetered({"--threads", "1", "--max-inflight", "64", "--max-memory-bytes",
                std::to_string(512 << 20), "--map", "town=" + WriteMap("town", 1)});
  ASSERT_FALSE(HasFatalFailure());
  const auto client =
      client::Client::Connect({.address = address_, .timeout = std::chrono::minutes(2)});
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
