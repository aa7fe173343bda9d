#include "scanloc/client/client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/files/files.hpp"
#include "support/long_tests.hpp"
#include "support/same_answer.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::client {
namespace {

using ::testing::HasSubstr;

constexpr int kNumPlaces = 10;

class ClientTest : public testing::Test {
 protected:
  void Connect(const test::Maps& maps) {
    server_ = test::StartServer(maps);
    ClientOptions options;
    options.address = server_->address();
    // Only a test that fails waits for it.
    options.timeout = std::chrono::seconds(60);
    auto client = Client::Connect(options);
    ASSERT_TRUE(client.ok()) << client.status();
    client_.emplace(*std::move(client));
  }

  test::Gate gate_;  // outlives the threads that wait at it
  std::unique_ptr<server::Server> server_;
  std::optional<Client> client_;
};

TEST(Client, RefusesCertificatesThatAreNone) {
  for (const char* path : {"/dev/zero", "/", "/none"}) {
    const auto client = Client::Connect({.address = "127.0.0.1:1", .tls_ca_file = path});
    EXPECT_EQ(client.status().code(), absl::StatusCode::kInvalidArgument) << client.status();
  }
}

// A server that wants TLS says as little as none at all.
TEST(Client, SaysHowItTriedToConnect) {
  const auto client = Client::Connect({.address = "127.0.0.1:1"});
  EXPECT_EQ(client.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(client.status().message()),
              testing::HasSubstr("cannot connect without TLS; is it running"));
}

// So that robots have a server soon after it is back, for however long it was away.
TEST(Client, TriesToConnectEveryFewSeconds) {
  if (!test::LongTests()) GTEST_SKIP() << "takes half a minute";
  const FileDescriptor away(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address = {
      .sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}};
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(away.get(), any, size), 0);
  ASSERT_EQ(listen(away.get(), 8), 0);
  ASSERT_EQ(getsockname(away.get(), any, &size), 0);
  const auto client =
      Client::Connect({.address = absl::StrCat("127.0.0.1:", ntohs(address.sin_port)),
                       .timeout = std::chrono::milliseconds(100),
                       .connect_timeout = std::chrono::milliseconds(0)});
  ASSERT_TRUE(client.ok()) << client.status();
  std::jthread robot([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) EXPECT_FALSE(client->ListMaps().ok());
  });
  for (int i = 0; i < 9; ++i) {
    pollfd tried = {.fd = away.get(), .events = POLLIN, .revents = 0};
    ASSERT_EQ(poll(&tried, 1, 15'000), 1) << i;
    const FileDescriptor hung_up(accept(away.get(), nullptr, nullptr));
  }
}

TEST_F(ClientTest, SendsNoTextThatIsNone) {
  Connect({{"town", test::SmallMap(1, 2)}});
  const PointCloud scan = test::QueryScan(1, 0);
  RobotStream stream = client_->OpenStream().value();
  const RequestOptions of_frame{.header = {.frame_id = "lidar\xff"}};
  testing::internal::CaptureStderr();
  for (const auto& [status, text] : std::vector<std::pair<absl::Status, std::string>>{
           {client_->GetMapInfo("\xff").status(), "map is \"\\xff\""},
           {client_->OpenStream({.map = "\xff"}).status(), "map is \"\\xff\""},
           {client_->LocalizeScan(scan, of_frame).status(), "frame_id is \"lidar\\xff\""},
           {stream.Locate(scan, {}, of_frame.header).status(), "frame_id is \"lidar\\xff\""}}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(text + ", which is not UTF-8"));
  }
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::Not(HasSubstr("UTF-8")));
  EXPECT_TRUE(stream.Locate(scan).ok()) << "the stream goes on";
}

TEST_F(ClientTest, GetsTheAnswerOfALocalizerInEveryWay) {
  const Map map = test::SmallMap(1, kNumPlaces);
  Connect({{"town", map}});
  const auto localizer = test::LocalizerOf(map);
  auto describer = Describer::Create(map.params).value();
  for (int place = 0; place < kNumPlaces; ++place) {
    for (const char* method : {"a-pc", "a-cc"}) {
      SCOPED_TRACE(testing::Message() << place << " " << method);
      const PointCloud scan = test::QueryScan(1, place);
      RequestOptions options;
      options.query.method = ParseMethod(method).value();
      options.query.num_candidates = 4;
      options.query.max_answers = 3;
      const ScanDescriptor descriptor = describer.Describe(scan);
      const Answer expected = localizer->Localize(descriptor, options.query).value();

      const auto by_scan = client_->LocalizeScan(scan, options);
      ASSERT_TRUE(by_scan.ok()) << by_scan.status();
      test::ExpectSameAnswer(by_scan->answer, expected);
      EXPECT_EQ(by_scan->map, "town");
      EXPECT_EQ(by_scan->scan_counts->num_points, scan.size());

      const auto by_descriptor = client_->LocalizeByDescriptor(scan, options);
      ASSERT_TRUE(by_descriptor.ok()) << by_descriptor.status();
      test::ExpectSameAnswer(by_descriptor->answer, expected);

      const auto given = client_->LocalizeDescriptor(
          {.signature = DescriptorSignature(map.params), .descriptor = descriptor}, options);
      ASSERT_TRUE(given.ok()) << given.status();
      test::ExpectSameAnswer(given->answer, expected);
    }
  }
}

TEST_F(ClientTest, ListsMapsAndTellsOfEach) {
  const Map map = test::SmallMap(1, kNumPlaces);
  Connect({{"a", map}, {"b", test::SmallMap(2, 3)}});
  const auto maps = client_->ListMaps();
  ASSERT_TRUE(maps.ok()) << maps.status();
  ASSERT_EQ(maps->size(), 2U);
  EXPECT_EQ(maps->at(1).name, "b");
  EXPECT_EQ(maps->at(1).state, MapState::kServing);
  const auto info = client_->GetMapInfo("a");
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->params, map.params);
  EXPECT_EQ(info->content_id, map.content_id);
  EXPECT_EQ(info->sessions, map.sessions);
}

TEST_F(ClientTest, DescribesAnewWhenTheMapGetsOtherParameters) {
  Connect({{"town", test::SmallMap(1, kNumPlaces)}});
  const PointCloud scan = test::QueryScan(1, 3);
  ASSERT_TRUE(client_->LocalizeByDescriptor(scan).ok());

  Params coarse;
  coarse.voxel_size_m = 0.8;
  coarse.polar.num_sectors = 40;
  const Map other = test::SmallMap(1, kNumPlaces, coarse);
  ASSERT_TRUE(server_->maps().Serve("town", "file", other).ok());
  const auto reply = client_->LocalizeByDescriptor(scan);
  ASSERT_TRUE(reply.ok()) << reply.status();
  test::ExpectSameAnswer(
      reply->answer,
      test::LocalizerOf(other)->Localize(Describer::Create(coarse)->Describe(scan)).value());
}

TEST_F(ClientTest, SendsTheScanWhereSeveralMapsWantDescriptors) {
  Connect({{"town", test::SmallMap(1, kNumPlaces)}});
  const PointCloud scan = test::QueryScan(1, 3);
  ASSERT_TRUE(client_->LocalizeByDescriptor(scan).ok());
  Params coarse;
  coarse.polar.num_sectors = 40;
  server_->maps().Add("village");
  ASSERT_TRUE(server_->maps().Serve("village", "file", test::SmallMap(2, 4, coarse)).ok());
  for (int i = 0; i < 2; ++i) {  // with the only map's parameters at hand, and without
    const auto reply = client_->LocalizeByDescriptor(scan);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->map, "town");
    EXPECT_EQ(reply->answer.candidates.at(0).map, "town");
    EXPECT_EQ(reply->answer.candidates.at(0).place, 3);
    client_.emplace(*Client::Connect({.address = server_->address()}));
  }
}

TEST_F(ClientTest, GoesOnWhenTheMapGetsOtherContent) {
  Connect({{"town", test::SmallMap(1, kNumPlaces)}});
  ASSERT_TRUE(client_->LocalizeByDescriptor(test::QueryScan(1, 3)).ok());
  ASSERT_TRUE(server_->maps().Serve("town", "file", test::SmallMap(2, kNumPlaces)).ok());
  for (int i = 0; i < 3; ++i) {
    const auto reply = client_->LocalizeByDescriptor(test::QueryScan(2, i));
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.content_id, "content-2");
    EXPECT_EQ(reply->answer.candidates.at(0).place, i);
  }
}

TEST_F(ClientTest, MayBeUsedByManyThreads) {
  const Map map = test::SmallMap(1, kNumPlaces);
  Connect({{"town", map}});
  std::vector<std::thread> robots;
  std::atomic<int> num_right = 0;
  for (int robot = 0; robot < 6; ++robot) {
    robots.emplace_back([&, robot] {
      for (int i = 0; i < kNumPlaces; ++i) {
        const int place = (i + robot) % kNumPlaces;
        const PointCloud scan = test::QueryScan(1, place);
        const auto reply =
            robot % 2 == 0 ? client_->LocalizeByDescriptor(scan) : client_->LocalizeScan(scan);
        if (reply.ok() && reply->answer.candidates.at(0).place == place) ++num_right;
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(num_right, 6 * kNumPlaces);
}

TEST_F(ClientTest, PassesOnWhatTheServerSaysAndWhereItIs) {
  Connect({{"a", test::SmallMap(1, 3)}, {"b", test::SmallMap(2, 3)}});
  RequestOptions options;
  options.map = "c";
  for (const absl::Status& status :
       {client_->LocalizeScan(test::QueryScan(1, 0), options).status(),
        client_->LocalizeByDescriptor(test::QueryScan(1, 0), options).status(),
        client_->GetMapInfo("c").status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
    EXPECT_THAT(std::string(status.message()), HasSubstr("it has a, b"));
    EXPECT_THAT(std::string(status.message()), HasSubstr(server_->address()));
  }
}

TEST_F(ClientTest, PassesOnThatAMapDoesNotServeAMethod) {
  Params polar_only;
  polar_only.cart.enabled = false;
  Connect({{"town", test::SmallMap(1, 3, polar_only)}});
  RequestOptions options;
  options.query.method = ParseMethod("cc").value();
  EXPECT_EQ(client_->LocalizeByDescriptor(test::QueryScan(1, 0), options).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(client_->LocalizeScan(test::QueryScan(1, 0), options).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(ClientTest, IsRefusedDescriptorsOfOtherParameters) {
  Connect({{"town", test::SmallMap(1, 3)}});
  const absl::Status status =
      client_->LocalizeDescriptor({.signature = "other", .descriptor = {}}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("GetMapInfo"));
}

TEST_F(ClientTest, RefusesAScanThatIsNone) {
  Connect({{"town", test::SmallMap(1, 3)}});
  EXPECT_EQ(client_->LocalizeScan(PointCloud(limits::kMaxPointsPerScan + 1)).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(ClientTest, GivesUpAtTheDeadline) {
  Connect({{"town", test::SmallMap(1, 3)}});
  // Clients take turns: as several of them, all hold their threads before the query comes.
  for (int i = 0; i < server_->workers().num_threads(); ++i) {
    ASSERT_TRUE(server_->workers()
                    .Submit("holder " + std::to_string(i),
                            [&](const absl::StatusOr<int>&) { gate_.Wait(); })
                    .ok());
  }
  RequestOptions options;
  options.timeout = std::chrono::milliseconds(30);
  EXPECT_EQ(client_->LocalizeScan(test::QueryScan(1, 0), options).status().code(),
            absl::StatusCode::kDeadlineExceeded);
  options.timeout = std::chrono::milliseconds(0);
  EXPECT_EQ(client_->LocalizeScan(test::QueryScan(1, 0), options).status().code(),
            absl::StatusCode::kInvalidArgument);
  gate_.Open();
}

TEST_F(ClientTest, LearnsAtOnceThatTheServerIsGone) {
  Connect({{"town", test::SmallMap(1, 3)}});
  const std::string address = server_->address();
  server_.reset();
  const absl::Status status = client_->LocalizeScan(test::QueryScan(1, 0)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  const auto other = Client::Connect({.address = address});
  EXPECT_EQ(other.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(other.status().message()), HasSubstr(address));
}

TEST_F(ClientTest, FindsAServerThatComesBack) {
  const test::Maps maps = {{"town", test::SmallMap(1, 3)}};
  Connect(maps);
  server::ServerOptions options = test::OptionsFor(maps);
  options.listen = server_->address();
  server_.reset();
  EXPECT_FALSE(client_->ListMaps().ok());
  server_ = test::StartServer(maps, options);
  // Between attempts the channel waits; how long is gRPC's to say.
  while (!client_->ListMaps().ok()) std::this_thread::yield();
}

TEST(ClientOptions, NamesTheBadField) {
  using std::chrono::milliseconds;
  for (const ClientOptions& bad :
       {ClientOptions{.address = ""}, ClientOptions{.timeout = milliseconds(0)},
        ClientOptions{.timeout = std::chrono::hours(2)},
        ClientOptions{.connect_timeout = milliseconds(-1)}}) {
    EXPECT_EQ(Client::Connect(bad).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(ClientOptions, ConnectsAtTheFirstCallIfToldNotToWait) {
  const auto client =
      Client::Connect({.address = "127.0.0.1:1", .connect_timeout = std::chrono::milliseconds(0)});
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_EQ(client->ListMaps().status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace scanloc::client
