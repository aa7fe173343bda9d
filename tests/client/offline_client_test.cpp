#include "scanloc/client/offline_client.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "scanloc/client/client.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/proto/convert.hpp"
#include "support/map_files.hpp"
#include "support/same_answer.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::client {
namespace {

constexpr int kNumPlaces = 8;

class OfflineClientTest : public testing::Test {
 protected:
  void SetUp() override {
    path_ = dir_.File("town.scanloc");
    test::WriteSmallMap(path_, 1, kNumPlaces);
    auto opened = OfflineClient::Open(path_, "town");
    ASSERT_TRUE(opened.ok()) << opened.status();
    offline_ = *opened;
  }

  /// Of the same map.
  std::unique_ptr<server::Server> StartServer() {
    server::ServerOptions options;
    options.maps = {{.name = "town", .path = path_}};
    options.listen = "127.0.0.1:0";
    auto server = *server::Server::Start(
        options, [](const std::string& path, const Map*) { return mapdb::LoadMap(path); });
    EXPECT_TRUE(server->LoadMaps().ok());
    return server;
  }

  test::TempDir dir_;
  std::string path_;
  std::shared_ptr<const OfflineClient> offline_;
};

TEST_F(OfflineClientTest, AnswersAsAServerOfTheSameMap) {
  const auto server = StartServer();
  const Client online = *Client::Connect({.address = server->address()});
  EXPECT_EQ(*offline_->GetMapInfo("town"), *online.GetMapInfo("town"));
  EXPECT_EQ(*offline_->ListMaps(), *online.ListMaps());
  EXPECT_EQ(offline_->ListPlaces("town")->places.size(), std::size_t{kNumPlaces});
  EXPECT_EQ(proto::ToProto(*offline_->ListPlaces("town")).SerializeAsString(),
            proto::ToProto(*online.ListPlaces("town")).SerializeAsString());
  auto describer = *Describer::Create(offline_->GetMapInfo()->params);
  for (const LocalizationClient* either : {static_cast<const LocalizationClient*>(&online),
                                           static_cast<const LocalizationClient*>(&*offline_)}) {
    for (int place = 0; place < kNumPlaces; ++place) {
      RequestOptions request;
      request.query.max_answers = 3;
      const PointCloud scan = test::QueryScan(1, place);
      const auto expected = online.LocalizeScan(scan, request);
      ASSERT_TRUE(expected.ok()) << expected.status();
      const auto by_scan = either->LocalizeScan(scan, request);
      ASSERT_TRUE(by_scan.ok()) << by_scan.status();
      test::ExpectSameAnswer(by_scan->answer, expected->answer);
      EXPECT_EQ(by_scan->map, "town");
      EXPECT_EQ(by_scan->scan_counts->num_points, expected->scan_counts->num_points);
      const SignedDescriptor descriptor{DescriptorSignature(offline_->GetMapInfo()->params),
                                        describer.Describe(scan)};
      const auto by_descriptor = either->LocalizeDescriptor(descriptor, request);
      ASSERT_TRUE(by_descriptor.ok()) << by_descriptor.status();
      test::ExpectSameAnswer(by_descriptor->answer, expected->answer);
    }
  }
}

TEST_F(OfflineClientTest, AnswersManyThreadsAtOnce) {
  const auto expected = offline_->LocalizeScan(test::QueryScan(1, 3));
  ASSERT_TRUE(expected.ok());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int j = 0; j < 10; ++j) {
        const auto reply = offline_->LocalizeScan(test::QueryScan(1, 3));
        ASSERT_TRUE(reply.ok());
        test::ExpectSameAnswer(reply->answer, expected->answer);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(OfflineClientTest, TracksARobotAsAServerDoes) {
  const auto server = StartServer();
  const Client online = *Client::Connect({.address = server->address()});
  auto here = *offline_->OpenStream();
  auto there = *online.OpenStream();
  for (int place = 0; place < kNumPlaces; ++place) {
    const auto told = here.Locate(test::QueryScan(1, place));
    const auto expected = there.Locate(test::QueryScan(1, place));
    ASSERT_TRUE(told.ok() && expected.ok()) << told.status() << expected.status();
    test::ExpectSameAnswer(told->reply.answer, expected->reply.answer);
    EXPECT_EQ(told->num_scans, expected->num_scans);
    EXPECT_EQ(told->is_relocated, expected->is_relocated);
  }
  for (RobotStream* stream : {&here, &there}) {
    EXPECT_TRUE(stream->Close().ok());
    const absl::Status ended = stream->Locate(test::QueryScan(1, 0)).status();
    EXPECT_EQ(ended.code(), absl::StatusCode::kFailedPrecondition) << ended;
  }
}

TEST_F(OfflineClientTest, TellsOfTheBaseOfAMountedSensorAsAServerDoes) {
  const auto server = StartServer();
  const Client online = *Client::Connect({.address = server->address()});
  SensorMount mount{.min_range_m = 0.5};
  mount.T_base_sensor = *MountPose({0.4, 0.1, 1.5}, {180.0, 0.0, 90.0});
  Pose turn = Pose::Identity();
  turn.linear() = mount.T_base_sensor.linear();
  const PointCloud upright = test::QueryScan(1, 2);
  PointCloud scan = scenes::SeenFrom(upright, turn);
  scan.push_back({0.1F, 0.1F, 0.1F});
  const RequestOptions request{.mount = mount, .header = {.stamp_ns = 7, .frame_id = "lidar"}};

  const auto told = offline_->LocalizeScan(scan, request);
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(told->scan_counts->num_masked, 1U);
  const Pose T_map_turned = offline_->LocalizeScan(upright)->answer.candidates.at(0).T_map_query;
  const Pose& T_map_base = told->answer.candidates.at(0).T_map_query;
  EXPECT_TRUE((T_map_turned * BaseInTurned(mount)).isApprox(T_map_base, 1e-2));
  const auto by_scan = online.LocalizeScan(scan, request);
  const auto by_descriptor = online.LocalizeByDescriptor(scan, request);
  for (const auto& reply : {by_scan, by_descriptor}) {
    ASSERT_TRUE(reply.ok()) << reply.status();
    test::ExpectSameAnswer(reply->answer, told->answer);
    EXPECT_EQ(reply->header, request.header);
  }
  EXPECT_EQ(told->header, request.header);
  EXPECT_EQ(by_scan->scan_counts->num_masked, 1U);

  const Pose T_last_scan = *MountPose({0.1, 0.0, 0.0}, {0.0, 0.0, 5.0});
  auto here = *offline_->OpenStream({.mount = mount});
  for (const bool send_descriptor : {false, true}) {
    here = *offline_->OpenStream({.mount = mount});
    auto there = *online.OpenStream({.mount = mount, .send_descriptor = send_descriptor});
    for (int i = 0; i < 2; ++i) {
      const auto expected = here.Locate(scan, T_last_scan, request.header);
      const auto tracked = there.Locate(scan, T_last_scan, request.header);
      ASSERT_TRUE(expected.ok() && tracked.ok()) << expected.status() << tracked.status();
      test::ExpectSameAnswer(tracked->reply.answer, expected->reply.answer);
      EXPECT_EQ(tracked->reply.header, request.header);
      EXPECT_EQ(expected->reply.header, request.header);
    }
  }

  const RequestOptions bad{.mount = {.min_range_m = -1.0}};
  for (const LocalizationClient* either : {static_cast<const LocalizationClient*>(&online),
                                           static_cast<const LocalizationClient*>(&*offline_)}) {
    EXPECT_TRUE(absl::IsInvalidArgument(either->LocalizeScan(scan, bad).status()));
    EXPECT_TRUE(absl::IsInvalidArgument(either->LocalizeByDescriptor(scan, bad).status()));
  }
}

TEST_F(OfflineClientTest, EndsInTime) {
  // No machine describes so many points in a millisecond.
  const PointCloud large(1'000'000, Point{10.0F, 5.0F, 1.0F});
  EXPECT_EQ(
      offline_->LocalizeScan(large, {.timeout = std::chrono::milliseconds(1)}).status().code(),
      absl::StatusCode::kDeadlineExceeded);
  for (const auto& [budget, timeout] : {std::pair(-1, 100), std::pair(0, 0), std::pair(0, -5)}) {
    const RequestOptions bad{.timeout = std::chrono::milliseconds(timeout),
                             .budget = std::chrono::milliseconds(budget)};
    EXPECT_EQ(offline_->LocalizeScan(test::QueryScan(1, 1), bad).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST_F(OfflineClientTest, RefusesWhatAServerRefuses) {
  EXPECT_EQ(offline_->GetMapInfo("other").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(offline_->LocalizeScan(test::QueryScan(1, 1), {.map = "other"}).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(offline_->LocalizeDescriptor({.signature = "other"}).status().code(),
            absl::StatusCode::kFailedPrecondition);
  RequestOptions bad;
  bad.query.num_candidates = 0;
  EXPECT_EQ(offline_->LocalizeScan(test::QueryScan(1, 1), bad).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(OfflineClient::Open(dir_.File("absent")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(OfflineClient::Open(dir_.Write("text", "no map")).ok());
}

}  // namespace
}  // namespace scanloc::client
