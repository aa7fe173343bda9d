// What streams of moving robots are answered: the client library against a real server.
#include "scanloc/client/robot_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "robot_stream_fixture.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "scanloc/proto/status.hpp"
#include "support/same_answer.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

/// How the robot gets from one query's pose to the next, if it drives along the places.
std::optional<Pose> Odometry(const Map& map, int place) {
  if (place == 0) return std::nullopt;
  const auto pose = [&](int i) {
    return map.places[static_cast<std::size_t>(i)].T_map_place * PlanarOffset(0.3, 0.5 + 0.1 * i);
  };
  return pose(place - 1).inverse() * pose(place);
}

v1::LocalizeStreamRequest ConfigFor(const std::string& map) {
  v1::LocalizeStreamRequest request;
  request.mutable_config()->set_map(map);
  return request;
}

TEST(RobotStream, AnswersAsATrackerDoes) {
  const Map map = test::SmallMap(1, kNumPlaces);
  const auto server = test::StartServer({{"town", map}});
  const client::Client client = ConnectTo(*server);
  for (const bool send_descriptor : {true, false}) {
    auto stream = client.OpenStream(
        {.map = "town", .query = {.max_answers = 3}, .send_descriptor = send_descriptor});
    ASSERT_TRUE(stream.ok()) << stream.status();
    auto tracker = *Tracker::Create(test::LocalizerOf(map), {.query = {.max_answers = 3}});
    auto describer = *Describer::Create(map.params);
    for (int place = 0; place < kNumPlaces; ++place) {
      const PointCloud scan = test::QueryScan(1, place);
      const auto told = stream->Locate(scan, Odometry(map, place));
      ASSERT_TRUE(told.ok()) << told.status();
      // As it arrives: over the wire a rotation is a quaternion.
      v1::StreamScan wire;
      proto::SetOdometry(Odometry(map, place), &wire);
      const auto expected =
          tracker.Update(describer.Describe(scan), *proto::OdometryFromProto(wire));
      test::ExpectSameAnswer(told->reply.answer, expected->answer);
      EXPECT_EQ(told->num_scans, expected->num_scans);
      EXPECT_EQ(told->num_scans, place + 1);
      EXPECT_EQ(told->is_relocated, expected->is_relocated);
      EXPECT_EQ(told->reply.map, "town");
    }
    EXPECT_TRUE(stream->Close().ok());
    EXPECT_EQ(stream->Locate(test::QueryScan(1, 0)).status().code(),
              absl::StatusCode::kFailedPrecondition);
  }
}

TEST(RobotStream, KeepsRobotsApart) {
  const Map map = test::SmallMap(1, kNumPlaces);
  const auto server = test::StartServer({{"town", map}});
  const client::Client client = ConnectTo(*server);
  std::vector<std::thread> robots;
  for (int first = 0; first < 4; ++first) {
    robots.emplace_back([&, first] {
      auto stream = client.OpenStream();
      ASSERT_TRUE(stream.ok()) << stream.status();
      for (int i = 0; i < 8; ++i) {
        const auto told = stream->Locate(test::QueryScan(1, first),
                                         i == 0 ? std::nullopt : std::optional(Pose::Identity()));
        ASSERT_TRUE(told.ok()) << told.status();
        EXPECT_EQ(told->reply.answer.candidates.front().place, first);
        EXPECT_EQ(told->num_scans, i + 1);
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
}

TEST(RobotStream, BeginsAnewWhenTheMapIsReplaced) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  const client::Client client = ConnectTo(*server);
  auto stream = client.OpenStream();
  EXPECT_EQ(stream->Locate(test::QueryScan(1, 0))->num_scans, 1);
  EXPECT_EQ(stream->Locate(test::QueryScan(1, 0), Pose::Identity())->num_scans, 2);
  Map other = test::SmallMap(1, kNumPlaces);
  other.content_id = "newer";
  ASSERT_TRUE(server->maps().Serve("town", "file", std::move(other)).ok());
  const auto told = stream->Locate(test::QueryScan(1, 0), Pose::Identity());
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(told->num_scans, 1);
  EXPECT_EQ(told->reply.answer.content_id, "newer");
}

TEST(RobotStream, OfABadConfigurationEndsAndSaysWhy) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  struct Case {
    v1::LocalizeStreamRequest request;
    grpc::StatusCode code;
    const char* why;
  };
  std::vector<Case> cases;
  cases.push_back({ConfigFor("village"), grpc::StatusCode::NOT_FOUND, "village"});
  cases.push_back({{}, grpc::StatusCode::INVALID_ARGUMENT, "must be its configuration"});
  cases.push_back(
      {StreamRequest(0), grpc::StatusCode::INVALID_ARGUMENT, "must be its configuration"});
  v1::LocalizeStreamRequest request = ConfigFor("town");
  request.mutable_config()->mutable_options()->set_method(v1::METHOD_A_PC);
  cases.push_back({request, grpc::StatusCode::INVALID_ARGUMENT, "auto, not a-pc"});
  request = ConfigFor("town");
  request.mutable_config()->set_max_step_m(-1.0);
  cases.push_back({request, grpc::StatusCode::INVALID_ARGUMENT, "max_step_m"});
  for (const Case& c : cases) {
    RawStream stream(*server);
    EXPECT_FALSE(stream.Say(c.request));
    const grpc::Status status = stream.End();
    EXPECT_EQ(status.error_code(), c.code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(c.why));
  }
}

TEST(RobotStream, GoesOnAfterAScanThatIsBad) {
  const Map map = test::SmallMap(1, kNumPlaces);
  const auto server = test::StartServer({{"town", map}});
  std::vector<std::pair<v1::LocalizeStreamRequest, const char*>> bad;
  v1::LocalizeStreamRequest request;
  request.mutable_scan();
  bad.emplace_back(request, "neither scan nor descriptors");
  request.mutable_scan()->mutable_scan()->set_num_points(1 << 30);
  bad.emplace_back(request, "num_points");
  request = StreamRequest(0);
  request.mutable_scan()->mutable_t_last_scan()->set_qw(3.0);
  bad.emplace_back(request, "T_last_scan");
  request.mutable_scan()->mutable_t_last_scan()->set_x_m(1e9);
  bad.emplace_back(request, "T_last_scan");

  RawStream stream(*server);
  ASSERT_TRUE(stream.Configure("town"));
  EXPECT_EQ(stream.response().opened().content_id(), map.content_id);
  for (const auto& [bad_scan, why] : bad) {
    ASSERT_TRUE(stream.Say(bad_scan));
    const absl::Status told = proto::FromErrorStatus(stream.response().error());
    EXPECT_EQ(told.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(told.message()), HasSubstr(why));
    EXPECT_EQ(proto::ReasonOf(told), v1::ERROR_REASON_INVALID_REQUEST);
    ASSERT_TRUE(stream.Say(StreamRequest(0)));
    EXPECT_GT(stream.response().answer().num_scans(), 0);
  }
}

TEST(RobotStream, KnowsHowFarItWentWithAScanThatWasBad) {
  const Map map = test::SmallMap(1, kNumPlaces);
  const auto server = test::StartServer({{"town", map}});
  RawStream stream(*server);
  ASSERT_TRUE(stream.Configure());
  ASSERT_TRUE(stream.Say(StreamRequest(0)));
  v1::LocalizeStreamRequest bad;
  proto::SetOdometry(*Odometry(map, 1), bad.mutable_scan());
  ASSERT_TRUE(stream.Say(bad));
  ASSERT_TRUE(stream.response().has_error());
  v1::LocalizeStreamRequest good = StreamRequest(2);
  proto::SetOdometry(*Odometry(map, 2), good.mutable_scan());
  ASSERT_TRUE(stream.Say(good));
  EXPECT_EQ(stream.response().answer().num_scans(), 2);
}

TEST(RobotStream, IsConfiguredOnce) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  RawStream stream(*server);
  ASSERT_TRUE(stream.Configure("town"));
  EXPECT_TRUE(stream.Say(StreamRequest(0)));
  EXPECT_EQ(stream.response().answer().num_scans(), 1);
  EXPECT_FALSE(stream.Configure("town"));
  EXPECT_THAT(stream.End().error_message(), HasSubstr("one configuration"));
}

TEST(RobotStream, OfBytesThatAreNoMessageIsRefused) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, kNumPlaces)}});
  EXPECT_EQ(test::CallWithBytes(test::ChannelTo(server->address()),
                                "/scanloc.v1.Localization/LocalizeStream", "\xff\xff\xff\xff")
                .error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace scanloc::server
