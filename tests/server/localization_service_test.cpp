#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "scanloc/core/limits.hpp"
#include "support/raw_call.hpp"
#include "support/same_answer.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

/// One server for all tests of the file: two maps of other places, and one of other parameters.
class LocalizationServiceTest : public testing::Test {
 protected:
  static constexpr int kNumPlaces = 20;

  static void SetUpTestSuite() {
    Params coarse;
    coarse.voxel_size_m = 1.0;
    maps_ = new test::Maps{{"north", test::SmallMap(1, kNumPlaces)},
                           {"south", test::SmallMap(2, kNumPlaces)},
                           {"coarse", test::SmallMap(3, 4, coarse)}};
    ServerOptions options = test::OptionsFor(*maps_);
    options.max_points = static_cast<int>(limits::kMaxPointsPerScan);
    options.max_message_bytes = limits::kMaxMessageBytes;
    options.allow_slow_methods = true;
    server_ = test::StartServer(*maps_, options).release();
  }
  static void TearDownTestSuite() {
    delete server_;
    delete maps_;
  }

  /// The server must still answer.
  void TearDown() override {
    v1::LocalizeResponse response;
    const grpc::Status status =
        test::Localize(*stub_, test::ScanRequest(test::QueryScan(1, 0), "north"), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.outcome(), v1::OUTCOME_LOCALIZED);
    EXPECT_EQ(response.candidates(0).place(), 0);
  }

  [[nodiscard]] grpc::Status Ask(const v1::LocalizeRequest& request) {
    response_.Clear();
    return test::Localize(*stub_, request, &response_);
  }

  void ExpectRefused(const v1::LocalizeRequest& request, grpc::StatusCode code, const char* why) {
    const grpc::Status status = Ask(request);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(why));
  }

  static test::Maps* maps_;
  static Server* server_;
  std::shared_ptr<grpc::Channel> channel_ = test::ChannelTo(server_->address());
  std::unique_ptr<v1::Localization::Stub> stub_ = v1::Localization::NewStub(channel_);
  v1::LocalizeResponse response_;
};

test::Maps* LocalizationServiceTest::maps_ = nullptr;
Server* LocalizationServiceTest::server_ = nullptr;

TEST_F(LocalizationServiceTest, AnswersAsALocalizerDoesToTheLastBit) {
  auto describer = Describer::Create(Params()).value();
  for (const auto& [name, seed] : {std::pair("north", 1), std::pair("south", 2)}) {
    const auto localizer = test::LocalizerOf(maps_->at(name));
    for (int place = 0; place < kNumPlaces; ++place) {
      const PointCloud scan = test::QueryScan(seed, place);
      for (const char* method : {"pc", "cc", "a-pc", "a-cc", "a-pc-naive-brute"}) {
        SCOPED_TRACE(testing::Message() << name << " " << place << " " << method);
        Query query{.method = ParseMethod(method).value(),
                    .num_candidates = 1 + place % 5,
                    .max_answers = 1 + place % 3};
        if (place % 4 == 0) query.threshold = 0.2;
        const Answer expected = localizer->Localize(describer.Describe(scan), query).value();

        v1::LocalizeRequest request = test::ScanRequest(scan, name);
        *request.mutable_options() = proto::ToProto(query);
        ASSERT_TRUE(Ask(request).ok());
        test::ExpectSameAnswer(proto::FromProto(response_)->answer, expected);

        *request.mutable_descriptors() = test::DescriptorRequest(scan, Params()).descriptors();
        ASSERT_TRUE(Ask(request).ok());
        test::ExpectSameAnswer(proto::FromProto(response_)->answer, expected);
        EXPECT_EQ(response_.map(), name);
      }
    }
  }
}

TEST_F(LocalizationServiceTest, GivesManyClientsAtOnceTheSameAnswers) {
  const auto localizer = test::LocalizerOf(maps_->at("north"));
  auto describer = Describer::Create(Params()).value();
  std::vector<Answer> expected;
  for (int place = 0; place < kNumPlaces; ++place) {
    const auto answer = localizer->Localize(describer.Describe(test::QueryScan(1, place)));
    expected.push_back(answer.value());
  }
  std::vector<std::thread> clients;
  for (int client = 0; client < 6; ++client) {
    clients.emplace_back([&, client] {
      const auto channel = test::ChannelTo(server_->address());
      const auto stub = v1::Localization::NewStub(channel);
      for (int i = 0; i < kNumPlaces; ++i) {
        const int place = (i + 3 * client) % kNumPlaces;
        const PointCloud scan = test::QueryScan(1, place);
        v1::LocalizeRequest request = test::DescriptorRequest(scan, Params());
        if (client % 2 == 0) request = test::ScanRequest(scan);
        request.set_map("north");
        v1::LocalizeResponse response;
        const grpc::Status status = test::Localize(*stub, request, &response);
        ASSERT_TRUE(status.ok()) << status.error_message();
        test::ExpectSameAnswer(proto::FromProto(response)->answer, expected[place]);
      }
    });
  }
  for (std::thread& client : clients) client.join();
}

TEST_F(LocalizationServiceTest, TellsTimesAndCounts) {
  PointCloud scan = test::QueryScan(1, 0);
  scan.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  scan.push_back({0, std::numeric_limits<float>::infinity(), 0});
  scan.push_back({0, 0, 1e6F});
  ASSERT_TRUE(Ask(test::ScanRequest(scan, "north")).ok());
  EXPECT_EQ(response_.scan_counts().num_points(), scan.size());
  EXPECT_EQ(response_.scan_counts().num_not_finite(), 2U);
  EXPECT_EQ(response_.scan_counts().num_beyond_limit(), 1U);
  EXPECT_GT(response_.scan_counts().num_voxels(), 0U);
  EXPECT_GT(response_.times().queue_ns(), 0);
  EXPECT_GT(response_.times().decode_ns(), 0);
  EXPECT_GT(response_.times().describe_ns(), 0);
  EXPECT_GT(response_.times().retrieve_ns(), 0);
  EXPECT_GT(response_.times().match_ns(), 0);
  EXPECT_GT(response_.times().verify_ns(), 0);
}

TEST_F(LocalizationServiceTest, AnswersAnEmptyScanAndOneOfNansWithInsufficientScan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PointCloud& scan :
       {PointCloud(), PointCloud(5000, Point{nan, nan, nan}), PointCloud(1, Point{1, 2, 3})}) {
    ASSERT_TRUE(Ask(test::ScanRequest(scan, "north")).ok());
    EXPECT_EQ(response_.outcome(), v1::OUTCOME_INSUFFICIENT_SCAN);
    EXPECT_EQ(response_.candidates_size(), 0);
  }
}

TEST_F(LocalizationServiceTest, RefusesHundredMillionPointsAnnounced) {
  v1::LocalizeRequest request = test::ScanRequest(PointCloud(3), "north");
  request.mutable_scan()->set_num_points(100'000'000);
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "100000000");
}

TEST_F(LocalizationServiceTest, RefusesAMapItDoesNotHave) {
  ExpectRefused(test::ScanRequest(PointCloud(3), "east"), grpc::StatusCode::NOT_FOUND,
                "coarse, north, south");
  ExpectRefused(test::ScanRequest(PointCloud(3), std::string(100'000, 'x')),
                grpc::StatusCode::INVALID_ARGUMENT, "map");
}

TEST_F(LocalizationServiceTest, RefusesDescriptorsOfOtherParameters) {
  v1::LocalizeRequest request = test::DescriptorRequest(test::QueryScan(1, 0), Params());
  request.set_map("coarse");
  ExpectRefused(request, grpc::StatusCode::FAILED_PRECONDITION, "GetMapInfo");
}

TEST_F(LocalizationServiceTest, RefusesDescriptorsThatBelieTheirSignature) {
  v1::LocalizeRequest request = test::DescriptorRequest(test::QueryScan(1, 0), Params());
  request.set_map("north");
  v1::LocalizeRequest bad = request;
  bad.mutable_descriptors()->mutable_polar()->set_num_rows(60);
  bad.mutable_descriptors()->mutable_polar()->set_num_cols(20);
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "");
  bad = request;
  bad.mutable_descriptors()->clear_cart();
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "");
  bad = request;
  bad.mutable_descriptors()->mutable_polar()->mutable_cells_u16le()->assign(2400, '\xff');
  ExpectRefused(bad, grpc::StatusCode::INVALID_ARGUMENT, "");
}

TEST_F(LocalizationServiceTest, RefusesBadOptions) {
  v1::LocalizeRequest request = test::ScanRequest(test::QueryScan(1, 0), "north");
  request.mutable_options()->set_num_candidates(-1);
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "options.num_candidates is -1");
  request.mutable_options()->Clear();
  request.mutable_options()->set_threshold(std::numeric_limits<double>::quiet_NaN());
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "options.threshold");
  request.mutable_options()->Clear();
  request.mutable_options()->set_method(static_cast<v1::Method>(77));
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "options.method is 77");
}

TEST_F(LocalizationServiceTest, RefusesAQueryOfNothing) {
  v1::LocalizeRequest request;
  request.set_map("north");
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "neither scan nor descriptors");
}

TEST_F(LocalizationServiceTest, RefusesBytesThatAreNoMessage) {
  std::mt19937 random(7);
  for (const char* method : {"Localize", "ListMaps", "GetMapInfo", "ListPlaces"}) {
    const std::string path = std::string("/scanloc.v1.Localization/") + method;
    const std::string truncated =
        test::ScanRequest(test::QueryScan(1, 0), "north").SerializeAsString();
    std::vector<std::string> requests = {
        std::string("\xff\xff\xff\xff\xff"), std::string("\x0a\xff\xff\xff\xff\x0f"),
        truncated.substr(0, 1000), std::string("\x0a\x02\xc3\x28", 4)};  // a name not UTF-8
    for (const std::string& request : requests) {
      const grpc::Status status = test::CallWithBytes(channel_, path, request);
      if (std::string_view(method) == "Localize") {
        EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT)
            << status.error_message();
        EXPECT_THAT(status.error_message(), HasSubstr("scanloc.v1.LocalizeRequest"));
      } else {
        EXPECT_NE(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
      }
    }
    for (int i = 0; i < 200; ++i) {
      std::string garbage(random() % 300, '\0');
      for (char& c : garbage) c = static_cast<char>(random());
      const grpc::Status status = test::CallWithBytes(channel_, path, garbage);
      EXPECT_NE(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    }
  }
}

TEST_F(LocalizationServiceTest, SurvivesAGoodRequestWithAnyByteSpoilt) {
  const std::string good =
      test::DescriptorRequest(test::QueryScan(1, 0), Params()).SerializeAsString();
  std::mt19937 random(11);
  for (int i = 0; i < 300; ++i) {
    std::string bad = good;
    // Near the start lie the lengths and the signature.
    const std::size_t at = i % 2 == 0 ? random() % 120 : random() % bad.size();
    bad[at] = static_cast<char>(random());
    const grpc::Status status =
        test::CallWithBytes(channel_, "/scanloc.v1.Localization/Localize", bad);
    EXPECT_NE(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    EXPECT_NE(status.error_code(), grpc::StatusCode::INTERNAL) << status.error_message();
  }
}

TEST_F(LocalizationServiceTest, RefusesAMessageOverTheLimitUnread) {
  const std::string huge(limits::kMaxMessageBytes + 1, '\0');
  const grpc::Status status =
      test::CallWithBytes(channel_, "/scanloc.v1.Localization/Localize", huge);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
}

TEST_F(LocalizationServiceTest, RefusesALongRequestForAShortMethod) {
  v1::GetMapInfoRequest request;
  request.set_map(std::string(1'000'000, 'x'));
  const grpc::Status status = test::CallWithBytes(channel_, "/scanloc.v1.Localization/GetMapInfo",
                                                  request.SerializeAsString());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
}

TEST_F(LocalizationServiceTest, AnswersTheLargestScan) {
  PointCloud scan = test::QueryScan(1, 3);
  scan.resize(limits::kMaxPointsPerScan, scan.front());
  ASSERT_TRUE(Ask(test::ScanRequest(scan, "north")).ok());
  EXPECT_EQ(response_.scan_counts().num_points(), limits::kMaxPointsPerScan);
}

TEST_F(LocalizationServiceTest, TellsOfItsMaps) {
  grpc::ClientContext list_context;
  v1::ListMapsResponse list;
  ASSERT_TRUE(stub_->ListMaps(&list_context, {}, &list).ok());
  const auto maps = proto::FromProto(list).value();
  ASSERT_EQ(maps.size(), 3U);
  EXPECT_EQ(maps[0].name, "coarse");
  EXPECT_EQ(maps[1].content_id, "content-1");
  EXPECT_EQ(maps[2].num_places, kNumPlaces);

  grpc::ClientContext info_context;
  v1::GetMapInfoRequest request;
  request.set_map("coarse");
  v1::GetMapInfoResponse response;
  ASSERT_TRUE(stub_->GetMapInfo(&info_context, request, &response).ok());
  const MapInfo info = proto::FromProto(response.info()).value();
  EXPECT_EQ(info.params, maps_->at("coarse").params);
  EXPECT_EQ(info.sessions, maps_->at("coarse").sessions);
  EXPECT_EQ(info.num_places, 4);
}

TEST_F(LocalizationServiceTest, ListsPlacesPageByPage) {
  const auto ask = [&](int page_size, const std::string& token, const std::string& map = "coarse") {
    grpc::ClientContext context;
    v1::ListPlacesRequest request;
    request.set_map(map);
    request.set_page_size(page_size);
    request.set_page_token(token);
    v1::ListPlacesResponse response;
    const grpc::Status status = stub_->ListPlaces(&context, request, &response);
    return std::pair(status.error_code(), response);
  };
  std::string token;
  int num_told = 0;
  do {
    const auto [code, page] = ask(3, token);
    ASSERT_EQ(code, grpc::StatusCode::OK);
    EXPECT_EQ(page.first_place(), num_told);
    const PlacesPage told = proto::FromProto(page).value();
    for (const Place& place : told.places) {
      EXPECT_TRUE(
          place.T_map_place.isApprox(maps_->at("coarse").places[num_told++].T_map_place, 1e-14));
    }
    token = page.next_page_token();
  } while (!token.empty() && num_told < 100);
  EXPECT_EQ(num_told, 4);

  using Code = grpc::StatusCode;
  EXPECT_EQ(ask(-1, "").first, Code::INVALID_ARGUMENT);
  EXPECT_EQ(ask(1001, "").first, Code::INVALID_ARGUMENT);
  EXPECT_EQ(ask(3, "elsewhere").first, Code::INVALID_ARGUMENT);
  EXPECT_EQ(ask(3, "-4@").first, Code::INVALID_ARGUMENT);
  EXPECT_EQ(ask(3, "3@another content").first, Code::ABORTED);
  EXPECT_EQ(ask(3, "", "village").first, Code::NOT_FOUND);
  EXPECT_EQ(ask(3, "2147483647@" + ask(3, "").second.content_id()).second.places_size(), 0);
}

}  // namespace
}  // namespace scanloc::server
