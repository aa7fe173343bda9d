// Clients of a real server that are gone, or as good as gone, in mid-stream.
#include <filesystem>

#include "metered_scanlocd.hpp"
#include "support/http2.hpp"
#include "support/long_tests.hpp"
#include "support/scan_files.hpp"
#include "support/small_maps.hpp"

namespace scanloc::server {
namespace {

constexpr char kOpen[] = "scanloc_streams_open";
constexpr char kInFlight[] = "scanloc_in_flight";
constexpr char kStreamMethod[] = "/scanloc.v1.Localization/LocalizeStream";

class LostClientTest : public MeteredScanlocdTest {
 protected:
  void SetUp() override {
    const std::string map = dir_.File("town.scanloc");
    test::WriteSmallMap(map, 1, kNumPlaces, test::SmallParams());
    StartMetered({"--map", "town=" + map, "--max-streams", "3"});
  }

  void TearDown() override {
    ExpectOthersAreAnswered();
    ExpectStopsWell();
  }

  void ExpectOthersAreAnswered() const {
    const auto reply = Connect().LocalizeScan(test::QueryScan(1, 2));
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.candidates.front().place, 2);
  }

  void AwaitStreams(double number) const {
    AwaitMetric(kOpen, [number](double value) { return value == number; });
  }

  /// As many streams as the server takes can be opened: none is held for those who are gone.
  void ExpectRoomForStreams() const {
    AwaitStreams(0);
    std::vector<client::RobotStream> streams;
    const client::Client client = Connect();
    for (int i = 0; i < 3; ++i) {
      auto stream = client.OpenStream();
      ASSERT_TRUE(stream.ok()) << stream.status();
      const auto reply = stream->Locate(test::QueryScan(1, i));
      ASSERT_TRUE(reply.ok()) << reply.status();
      streams.push_back(*std::move(stream));
    }
  }

  /// A stream by hand, with so many requests sent.
  [[nodiscard]] test::TcpConnection OpenRawStream(int num_requests) const {
    v1::LocalizeStreamRequest request;
    request.mutable_config()->mutable_options()->set_max_answers(kNumPlaces);
    std::string bytes =
        test::Http2CallOpening(kStreamMethod) + test::Http2Message(request.SerializeAsString());
    *request.mutable_scan()->mutable_descriptors() =
        test::DescriptorRequest(test::QueryScan(1, 2), test::SmallParams()).descriptors();
    const std::string scan = test::Http2Message(request.SerializeAsString());
    for (int i = 0; i < num_requests; ++i) bytes += scan;
    test::TcpConnection connection(address_);
    connection.Send(bytes);
    return connection;
  }
};

TEST_F(LostClientTest, IsKilledInMidSequence) {
  constexpr int kNumScans = 200;
  for (int i = 0; i < kNumScans; ++i) {
    dir_.Write("drive/" + std::to_string(1000 + i) + ".bin",
               test::KittiBytes(test::QueryScan(1, i % kNumPlaces)));
  }
  for (int moment = 1; moment <= 5; ++moment) {
    // In step with its progress, which is told every tenth: it cannot end before it is killed.
    test::Process robot({test::BinDir() + "/scanloc", "locate", "--server", address_, "--sequence",
                         "--scans", dir_.File("drive")},
                        {.merge_stderr = true, .in_step = true});
    ASSERT_NE(robot.ReadLineWith("(" + std::to_string(10 * moment) + " %)"), "");
    AwaitStreams(1);
    robot.Signal(SIGKILL);
    EXPECT_EQ(robot.Wait(), -SIGKILL);
    AwaitStreams(0);
  }
  ExpectRoomForStreams();
}

TEST_F(LostClientTest, ResetsItsConnection) {
  for (const int num_requests : {0, 1, 20}) {
    {
      const test::TcpConnection connection = OpenRawStream(num_requests);
      AwaitStreams(1);
      connection.ResetAtEnd();
    }
    AwaitStreams(0);
  }
  ExpectRoomForStreams();
}

TEST_F(LostClientTest, HangsUpInTheMiddleOfAMessage) {
  for (const bool hard : {false, true}) {
    {
      const test::TcpConnection connection = OpenRawStream(1);
      const std::string message = test::Http2Message(std::string(1000, '\x12'));
      connection.Send(message.substr(0, message.size() / 2));
      AwaitStreams(1);
      if (hard) connection.ResetAtEnd();
    }
    AwaitStreams(0);
  }
  ExpectRoomForStreams();
}

TEST_F(LostClientTest, StopsReading) {
  {
    // More answers than fit into what it has allowed the server to send.
    const test::TcpConnection deaf = OpenRawStream(60);
    const test::TcpConnection silent = OpenRawStream(1);
    AwaitStreams(2);
    AwaitMetric(kInFlight, [](double value) { return value == 0.0; });
    EXPECT_EQ(Metric(kOpen), 2.0);
    for (int i = 0; i < 50; ++i) ExpectOthersAreAnswered();
    if (test::LongTests()) {
      // Neither answers the server's pings.
      const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(4);
      while (Metric(kOpen) > 0.0) {
        ASSERT_LT(std::chrono::steady_clock::now(), patience);
        std::this_thread::sleep_for(std::chrono::seconds(1));
      }
    }
  }
  ExpectRoomForStreams();
}

TEST_F(LostClientTest, StopsReadingWhenTheServerStops) {
  const test::TcpConnection deaf = OpenRawStream(60);
  AwaitStreams(1);
  AwaitMetric(kInFlight, [](double value) { return value == 0.0; });
  // What TearDown asks of the server.
}

}  // namespace
}  // namespace scanloc::server
