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

// What waits in streams is no other client's loss, and no attack.
TEST_F(StreamMemoryTest, OfManyLargeScansShutsNobodyOut) {
  // The queue is not what is tested: of large scans on a busy machine it may be long.
  StartMetered({"--threads", "1", "--max-wait-seconds", "60", "--max-memory-bytes",
                std::to_string(128 << 20), "--map", "town=" + WriteMap("town", 1)});
  ASSERT_FALSE(HasFatalFailure());
  const auto client =
      client::Client::Connect({.address = address_, .timeout = std::chrono::minutes(2)});
  ASSERT_TRUE(client.ok()) << client.status();
  const auto expect_answer = [&] {
    const absl::Status status = client->LocalizeScan(test::QueryScan(1, 2)).status();
    EXPECT_TRUE(status.ok()) << status;
  };
  expect_answer();
  const long before_kb = ResidentKb();

  const PointCloud large = scenes::RandomScan(1, 300'000);  // 3.6 MB
  std::atomic<int> num_busy = 20;
  std::vector<std::thread> robots;
  for (int i = num_busy; i > 0; --i) {
    robots.emplace_back([&] {
      auto stream = client->OpenStream({.send_descriptor = false});
      EXPECT_TRUE(stream.ok()) << stream.status();
      for (int scan = 0; stream.ok() && scan < (test::LongTests() ? 5 : 1); ++scan) {
        const auto told = stream->Locate(large);
        EXPECT_TRUE(told.ok()) << told.status();
      }
      --num_busy;
    });
  }
  while (num_busy > 0) expect_answer();
  for (std::thread& robot : robots) robot.join();

  Await("memory is given back", [&] { return ResidentKb() <= 2 * kSanitizerFactor * before_kb; });
  EXPECT_EQ(NumRebuilds("memory"), 0.0) << Log();
}

}  // namespace
}  // namespace scanloc::server
