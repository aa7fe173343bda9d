// How streams of moving robots are bounded, and how they end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "robot_stream_fixture.hpp"
#include "scanloc/client/robot_stream.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

TEST(RobotStream, IsRefusedAtOnceWhenTooManyAreOpen) {
  const test::Maps maps = {{"town", test::SmallMap(1, kNumPlaces)}};
  ServerOptions options = test::OptionsFor(maps);
  options.max_streams = 2;
  const auto server = test::StartServer(maps, options);
  RawStream one(*server);
  std::optional<RawStream> two(*server);
  ASSERT_TRUE(one.Configure());
  ASSERT_TRUE(two->Configure());
  {
    RawStream three(*server);
    EXPECT_FALSE(three.Configure());
    EXPECT_EQ(three.End().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  // A robot that vanishes makes room; when the server learns of it is not ours to say.
  two->HangUp();
  EXPECT_EQ(two->End().error_code(), grpc::StatusCode::CANCELLED);
  two.reset();
  for (bool is_open = false; !is_open;) {
    RawStream next(*server);
    is_open = next.Configure();
    EXPECT_EQ(next.End().error_code(),
              is_open ? grpc::StatusCode::OK : grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_TRUE(one.Say(StreamRequest(0)));
}

TEST(RobotStream, ThatWaitsForItsRobotDoesNotHoldUpTheEnd) {
  const test::Maps maps = {{"town", test::SmallMap(1, kNumPlaces)}};
  ServerOptions options = test::OptionsFor(maps);
  options.drain_s = 3600.0;
  const auto server = test::StartServer(maps, options);
  const client::Client client = ConnectTo(*server);
  auto stream = client.OpenStream();
  ASSERT_TRUE(stream->Locate(test::QueryScan(1, 0)).ok());
  server->Shutdown();
  const absl::Status status = stream->Locate(test::QueryScan(1, 0)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("draining"));
}

/// Keeps every worker of a server busy until it is opened.
void HoldWorkers(Server& server, test::Gate& gate) {
  for (int i = 0; i < server.workers().num_threads(); ++i) {
    ASSERT_TRUE(
        server.workers()
            .Submit("holder " + std::to_string(i), [&](const absl::StatusOr<int>&) { gate.Wait(); })
            .ok());
  }
}

TEST(RobotStream, OutlivesAQueueThatIsFull) {
  const test::Maps maps = {{"town", test::SmallMap(1, kNumPlaces)}};
  ServerOptions options = test::OptionsFor(maps);
  options.num_threads = 1;
  options.max_inflight = 1;
  const auto server = test::StartServer(maps, options);
  RawStream stream(*server);
  ASSERT_TRUE(stream.Configure());
  ASSERT_TRUE(stream.Say(StreamRequest(0)));
  test::Gate gate;
  // The worker may not have counted the answer out yet.
  while (
      !server->workers().Submit("holder", [&](const absl::StatusOr<int>&) { gate.Wait(); }).ok()) {
    std::this_thread::yield();
  }
  ASSERT_TRUE(stream.Send(StreamRequest(0)));
  // What comes later on the same connection is refused, so the scan has found the queue full, too.
  v1::LocalizeResponse response;
  EXPECT_EQ(test::Localize(stream.stub(), test::ScanRequest(test::QueryScan(1, 0)), &response)
                .error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  gate.Open();
  ASSERT_TRUE(stream.Hear());
  EXPECT_EQ(stream.response().answer().num_scans(), 2);  // the server still knows of the first
}

TEST(RobotStream, EndsWhenItsRobotIsSilentForTooLong) {
  const test::Maps maps = {{"town", test::SmallMap(1, kNumPlaces)}};
  ServerOptions options = test::OptionsFor(maps);
  options.stream_idle_s = 0.05;
  options.max_streams = 1;
  const auto server = test::StartServer(maps, options);
  RawStream silent(*server);
  const grpc::Status status = silent.Await();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_THAT(status.error_message(), HasSubstr("silent"));
}

TEST(RobotStream, DoesNotCountWhereItWasRefused) {
  const test::Maps maps = {{"town", test::SmallMap(1, kNumPlaces)}};
  ServerOptions options = test::OptionsFor(maps);
  options.max_streams = 3;
  options.max_streams_per_client = 1;
  const auto server = test::StartServer(maps, options);
  RawStream one(*server);
  ASSERT_TRUE(one.Configure());
  for (int i = 0; i < 5; ++i) {
    RawStream another(*server);
    EXPECT_EQ(another.Await().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_THAT(server->MetricsText(), HasSubstr("scanloc_streams_open 1\n"));
}

TEST(RobotStream, OfManyRobotsAtWorkEndWellWhenTheServerStops) {
  const Map map = test::SmallMap(1, 2);
  const v1::LocalizeStreamRequest request = StreamRequest(0);
  for (int round = 0; round < 15; ++round) {
    const auto server = test::StartServer({{"town", map}});
    std::atomic<int> num_answered = 0;
    std::vector<std::thread> robots;
    for (int i = 0; i < 8; ++i) {
      robots.emplace_back([&] {
        RawStream stream(*server);
        if (!stream.Configure()) return;
        while (stream.Say(request)) ++num_answered;
        const grpc::StatusCode code = stream.End().error_code();
        EXPECT_TRUE(code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::CANCELLED)
            << code;
      });
    }
    while (num_answered < round) std::this_thread::yield();
    server->Shutdown();
    for (std::thread& robot : robots) robot.join();
  }
}

TEST(RobotStream, EndsWhenAnAnswerIsLate) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  test::Gate gate;
  const client::Client client = ConnectTo(*server);
  auto stream = client.OpenStream({.timeout = std::chrono::milliseconds(1000)});
  ASSERT_TRUE(stream.ok()) << stream.status();
  HoldWorkers(*server, gate);
  EXPECT_EQ(stream->Locate(test::QueryScan(1, 0)).status().code(),
            absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(stream->Locate(test::QueryScan(1, 0)).status().code(),
            absl::StatusCode::kFailedPrecondition);
  gate.Open();
  EXPECT_TRUE(client.OpenStream()->Locate(test::QueryScan(1, 0)).ok());
}

TEST(RobotStream, MayOutliveItsClient) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  std::optional<client::Client> client(ConnectTo(*server));
  auto stream = client->OpenStream();
  client.reset();
  EXPECT_TRUE(stream->Locate(test::QueryScan(1, 0)).ok());
}

}  // namespace
}  // namespace scanloc::server
