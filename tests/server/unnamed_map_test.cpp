// Queries that name no map.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using Code = grpc::StatusCode;

/// A server of some maps, and what it says to a request.
class UnnamedMapTest : public testing::Test {
 protected:
  void Start(const test::Maps& maps) {
    server_ = test::StartServer(maps);
    stub_ = v1::Localization::NewStub(test::ChannelTo(server_->address()));
  }
  [[nodiscard]] Code Ask(const v1::LocalizeRequest& request) {
    response_.Clear();
    const grpc::Status status = test::Localize(*stub_, request, &response_);
    error_ = status.error_message();
    return status.error_code();
  }
  static v1::LocalizeRequest ScanOf(int seed, int place) {
    return test::ScanRequest(test::QueryScan(seed, place), "");
  }

  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::Localization::Stub> stub_;
  v1::LocalizeResponse response_;
  std::string error_;
};

Params Coarse() {
  Params coarse;
  coarse.voxel_size_m = 1.0;
  return coarse;
}

TEST_F(UnnamedMapTest, FindsTheMapOfTheScan) {
  Start({{"north", test::SmallMap(1, 12)},
         {"south", test::SmallMap(2, 12)},
         {"coarse", test::SmallMap(3, 4, Coarse())}});
  for (const auto& [name, seed] : {std::pair("north", 1), std::pair("south", 2)}) {
    ASSERT_EQ(Ask(ScanOf(seed, 5)), Code::OK) << error_;
    EXPECT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED) << response_.reason();
    EXPECT_EQ(response_.map(), name);
    EXPECT_EQ(response_.content_id(), "content-" + std::to_string(seed));
    ASSERT_EQ(response_.candidates_size(), 1);
    EXPECT_EQ(response_.candidates(0).map(), name);
    EXPECT_EQ(response_.candidates(0).place(), 5);
    EXPECT_GT(response_.times().describe_ns(), 0);
  }
}

TEST_F(UnnamedMapTest, IsAmbiguousWhereTwoMapsHoldThePlace) {
  Map twin = test::SmallMap(1, 12);
  twin.content_id = "another";
  Start({{"north", test::SmallMap(1, 12)}, {"twin", twin}});
  v1::LocalizeRequest request = ScanOf(1, 5);
  request.mutable_options()->set_max_answers(2);
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_AMBIGUOUS);
  ASSERT_EQ(response_.candidates_size(), 2);
  EXPECT_EQ(response_.candidates(0).map(), "north");
  EXPECT_EQ(response_.candidates(1).map(), "twin");

  request.set_map("twin");
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED);
  EXPECT_EQ(response_.candidates(0).map(), "");
}

TEST_F(UnnamedMapTest, LooksOnlyWhereAPriorOnEarthLies) {
  const GeoOrigin munich{48.1374, 11.5755, 519.0, 90.0, Eigen::Vector3d::Zero()};
  const GeoOrigin berlin{52.52, 13.405, 34.0, 0.0, Eigen::Vector3d::Zero()};
  Map north = test::SmallMap(1, 12);
  Map twin = north;
  twin.content_id = "another";
  v1::LocalizeRequest request = ScanOf(1, 5);
  v1::Prior::GeoDisc& disc = *request.mutable_options()->mutable_prior()->mutable_on_earth();
  disc.set_latitude_deg(48.137);
  disc.set_longitude_deg(11.576);
  disc.set_radius_m(500.0);

  Start({{"north", north}, {"twin", twin}});
  EXPECT_EQ(Ask(request), Code::FAILED_PRECONDITION) << "no map knows where it stands";
  north.geo_origin = munich;
  Start({{"north", north}, {"twin", twin}});
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_AMBIGUOUS) << "the twin may stand there, too";
  twin.geo_origin = berlin;
  Start({{"north", north}, {"twin", twin}});
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED) << response_.reason();
  EXPECT_EQ(response_.map(), "north");
  disc.set_latitude_deg(52.52);
  disc.set_longitude_deg(13.405);
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.map(), "twin");
  disc.set_radius_m(0.5);  // place 5 is farther off
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_NE(response_.outcome(), v1::OUTCOME_LOCALIZED);
  request.set_map("north");
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_NOT_RECOGNIZED);
}

TEST_F(UnnamedMapTest, CountsMapsOfOneContentOnce) {
  Start({{"north", test::SmallMap(1, 12)}, {"default", test::SmallMap(1, 12)}});
  ASSERT_EQ(Ask(ScanOf(1, 5)), Code::OK) << error_;
  EXPECT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED);
  EXPECT_EQ(response_.map(), "default");
}

TEST_F(UnnamedMapTest, TakesDescriptorsThatGoWithAllMaps) {
  Start({{"north", test::SmallMap(1, 12)}, {"south", test::SmallMap(2, 12)}});
  v1::LocalizeRequest request = test::DescriptorRequest(test::QueryScan(2, 5), Params());
  request.clear_map();
  ASSERT_EQ(Ask(request), Code::OK) << error_;
  EXPECT_EQ(response_.map(), "south");
}

TEST_F(UnnamedMapTest, RefusesWhatIsOneMapsOnly) {
  Params polar;
  polar.structure.enabled = false;
  Start({{"north", test::SmallMap(1, 12)},
         {"coarse", test::SmallMap(3, 4, Coarse())},
         {"polar", test::SmallMap(4, 4, polar)}});
  v1::LocalizeRequest descriptors = test::DescriptorRequest(test::QueryScan(1, 5), Params());
  descriptors.clear_map();
  descriptors.mutable_options()->set_method(v1::METHOD_A_PC);
  EXPECT_EQ(Ask(descriptors), Code::FAILED_PRECONDITION);
  EXPECT_THAT(error_, HasSubstr("map coarse"));

  v1::LocalizeRequest prior = ScanOf(1, 5);
  prior.mutable_options()->mutable_prior()->add_sessions("morning");
  prior.mutable_options()->set_method(v1::METHOD_A_PC);
  EXPECT_EQ(Ask(prior), Code::INVALID_ARGUMENT);
  EXPECT_THAT(error_, HasSubstr("the name of a map"));

  EXPECT_EQ(Ask(ScanOf(1, 5)), Code::FAILED_PRECONDITION);
  EXPECT_THAT(error_, HasSubstr("maps coarse and polar answer by different ones, auto and a-pc"));
}

TEST_F(UnnamedMapTest, RefusesMoreMapsThanOneQueryMayKeepAWorkerFor) {
  test::Maps maps;
  for (int i = 0; i < 33; ++i) maps["map-" + std::to_string(i)] = test::SmallMap(i, 1);
  Start(maps);
  EXPECT_EQ(Ask(ScanOf(1, 0)), Code::NOT_FOUND);
  EXPECT_THAT(error_, HasSubstr("33; at most 32"));
}

}  // namespace
}  // namespace scanloc::server
