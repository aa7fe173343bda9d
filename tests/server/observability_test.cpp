#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "observability_fixture.hpp"
#include "ops/logs.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(ObservabilityTest, PassesTheClientsRequestIdBack) {
  Start(Options());
  ASSERT_TRUE(Ask("robot-7/42").ok());
  EXPECT_EQ(TellsId(), "robot-7/42");
}

TEST_F(ObservabilityTest, NamesARequestThatHasNoIdOrABadOne) {
  Start(Options());
  std::set<std::string> ids;
  for (const std::string& sent : {std::string(), std::string("two words"), std::string(129, 'x')}) {
    ASSERT_TRUE(Ask(sent).ok());
    EXPECT_THAT(TellsId(), testing::MatchesRegex("[0-9a-f]+"));
    ids.insert(TellsId());
  }
  EXPECT_EQ(ids.size(), 3U);
}

// As a time point of nanoseconds it would be long past.
TEST_F(ObservabilityTest, TakesADeadlineBeyondTheYear2262) {
  Start(Options());
  grpc::ClientContext context;
  context.set_deadline(
      gpr_time_add(gpr_now(GPR_CLOCK_REALTIME), gpr_time_from_hours(300 * 366 * 24, GPR_TIMESPAN)));
  const grpc::Status status =
      stub_->Localize(&context, test::ScanRequest(test::QueryScan(1, 1)), &response_);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ObservabilityTest, CountsCallsByMethodCodeAndOutcome) {
  Start(Options());
  ASSERT_TRUE(Ask().ok());
  ASSERT_TRUE(Ask().ok());
  const std::string outcome = OutcomeName(static_cast<Outcome>(response_.outcome()));
  EXPECT_EQ(Ask(test::ScanRequest(test::QueryScan(1, 1), "nowhere")).error_code(),
            grpc::StatusCode::NOT_FOUND);
  const std::string text = server_->MetricsText();
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"OK\",map=\"town\",method=\"Localize\","
                              "outcome=\"" +
                              outcome + "\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"NOT_FOUND\",map=\"\",method="
                              "\"Localize\",outcome=\"none\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_confidence_count{map=\"town\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_request_duration_seconds_count{method=\"Localize\"} 3\n"));
  for (const char* stage : {"queue", "decode", "describe", "retrieve"}) {
    EXPECT_THAT(text, HasSubstr("scanloc_stage_duration_seconds_count{stage=\"" +
                                std::string(stage) + "\"} 2\n"));
  }
}

TEST_F(ObservabilityTest, TellsOfEveryMapAndItsLoads) {
  Start(Options());
  EXPECT_FALSE(server_->LoadMap("town").ok());
  std::string text = server_->MetricsText();
  EXPECT_THAT(text, HasSubstr("scanloc_map_serving{map=\"town\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_map_places{map=\"town\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_map_generation{map=\"town\"} 1\n"));
  EXPECT_THAT(text, ContainsRegex("scanloc_map_load_seconds.map=\"town\". [0-9]"));
  EXPECT_THAT(text, HasSubstr("scanloc_map_reload_failures_total{map=\"town\"} 0\n"));
  ASSERT_TRUE(server_->UnloadMap("town").ok());
  EXPECT_THAT(server_->MetricsText(), Not(HasSubstr("scanloc_map_serving{map=\"town\"}")));
}

TEST_F(ObservabilityTest, TellsOfTheProcess) {
  Start(Options());
  const std::string text = server_->MetricsText();
  EXPECT_THAT(text, ContainsRegex("process_resident_memory_bytes [1-9]"));
  EXPECT_THAT(text, ContainsRegex("process_open_fds [1-9]"));
  EXPECT_THAT(text, ContainsRegex("process_threads [1-9]"));
  EXPECT_THAT(text, HasSubstr("scanloc_build_info{"));
}

TEST_F(ObservabilityTest, TakesNoEndOfAStreamForATimeOfAnAnswer) {
  Start(Options());
  grpc::ClientContext context;
  test::SetPatience(context);
  auto stream = stub_->LocalizeStream(&context);
  v1::LocalizeStreamRequest request;
  request.mutable_config();
  v1::LocalizeStreamResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  *request.mutable_scan()->mutable_scan() = proto::ToProto(test::QueryScan(1, 1));
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  request.mutable_config();  // once only: refused
  ASSERT_TRUE(stream->Write(request));
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  server_->Shutdown();  // both were counted
  const std::string text = server_->MetricsText();
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"INVALID_ARGUMENT\",map=\"\",method=\""
                              "LocalizeStream\",outcome=\"none\"} 1\n"));
  EXPECT_THAT(text,
              HasSubstr("scanloc_request_duration_seconds_count{method=\"LocalizeStream\"} 1\n"));
}

TEST(LogLimit, LetsSoManyLinesThroughInEachPeriodAndTellsHowManyItLeftOut) {
  LogLimit limit(2, 1000);
  EXPECT_EQ(limit.MayLog(0), 0);
  EXPECT_EQ(limit.MayLog(1), 0);
  EXPECT_FALSE(limit.MayLog(2).has_value());
  EXPECT_FALSE(limit.MayLog(999).has_value());
  EXPECT_EQ(limit.MayLog(1000), 2);
  EXPECT_EQ(limit.MayLog(1001), 0);
  EXPECT_FALSE(limit.MayLog(1002).has_value());
  EXPECT_EQ(limit.MayLog(5000), 1);
}

TEST_F(ObservabilityTest, SaysWhyItCannotServeMetricsThere) {
  ServerOptions options = Options();
  options.metrics_listen = "127.0.0.1:0";
  Start(options);
  options.metrics_listen = server_->metrics_address();
  const auto second = Server::Start(options, test::LoaderOf(maps_));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(options.metrics_listen));
}

TEST_F(ObservabilityTest, RefusesAClientThatAsksTooOften) {
  ServerOptions options = Options();
  options.max_rate_per_s = 0.01;
  Start(options);
  ASSERT_TRUE(Ask().ok());
  const grpc::Status refused = Ask();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const auto delay_s = proto::RetryAfter(proto::FromGrpc(refused));
  ASSERT_TRUE(delay_s.has_value());
  EXPECT_GT(*delay_s, 50.0);
  EXPECT_THAT(server_->MetricsText(), HasSubstr("scanloc_rejected_total{reason=\"rate\"} 1\n"));
}

TEST_F(ObservabilityTest, RefusesScansAndSearchesBeyondItsLimits) {
  ServerOptions options = Options();
  options.max_points = 100;
  options.max_candidates = 3;
  Start(options);
  const grpc::Status large = Ask();
  EXPECT_EQ(large.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(large.error_message(), HasSubstr("this server allows 100"));
  v1::LocalizeRequest wide =
      test::DescriptorRequest(test::QueryScan(1, 1), maps_.at("town").params);
  wide.mutable_options()->set_num_candidates(4);
  const grpc::Status refused = Ask(wide);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("4 candidates"));
  wide.mutable_options()->set_num_candidates(3);
  EXPECT_TRUE(Ask(wide).ok());
}

TEST_F(ObservabilityTest, LimitsTheStreamsOfOneClient) {
  ServerOptions options = Options();
  options.max_streams_per_client = 1;
  Start(options);
  grpc::ClientContext first_context;
  test::SetPatience(first_context);
  auto first = stub_->LocalizeStream(&first_context);
  v1::LocalizeStreamRequest request;
  request.mutable_config();
  v1::LocalizeStreamResponse response;
  ASSERT_TRUE(first->Write(request));
  ASSERT_TRUE(first->Read(&response));
  {
    grpc::ClientContext context;
    test::SetPatience(context);
    auto second = stub_->LocalizeStream(&context);
    EXPECT_FALSE(second->Read(&response));
    const grpc::Status refused = second->Finish();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_TRUE(proto::RetryAfter(proto::FromGrpc(refused)).has_value());
  }
  EXPECT_THAT(server_->MetricsText(), HasSubstr("scanloc_rejected_total{reason=\"streams\"} 1\n"));
  ASSERT_TRUE(first->WritesDone());
  EXPECT_FALSE(first->Read(&response));
  EXPECT_TRUE(first->Finish().ok());
}

}  // namespace
}  // namespace scanloc::server
