#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "logs.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/capture.pb.h"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class ObservabilityTest : public testing::Test {
 protected:
  void Start(const ServerOptions& options) {
    server_ = test::StartServer(maps_, options);
    stub_ = v1::Localization::NewStub(test::ChannelTo(server_->address()));
  }

  [[nodiscard]] ServerOptions Options() const { return test::OptionsFor(maps_); }

  grpc::Status Ask(const v1::LocalizeRequest& request, const std::string& request_id = "") {
    context_ = std::make_unique<grpc::ClientContext>();
    test::SetPatience(*context_);
    if (!request_id.empty()) context_->AddMetadata("x-request-id", request_id);
    return stub_->Localize(context_.get(), request, &response_);
  }
  grpc::Status Ask(const std::string& request_id = "") {
    return Ask(test::ScanRequest(test::QueryScan(1, 1)), request_id);
  }

  [[nodiscard]] std::string TellsId() const {
    const auto& metadata = context_->GetServerInitialMetadata();
    const auto found = metadata.find("x-request-id");
    return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
  }

  const test::Maps maps_ = {{"town", test::SmallMap(1, 4)}};
  test::TempDir dir_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::Localization::Stub> stub_;
  std::unique_ptr<grpc::ClientContext> context_;
  v1::LocalizeResponse response_;
};

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
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"OK\",method=\"Localize\",outcome=\"" +
                              outcome + "\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"NOT_FOUND\",method=\"Localize\","
                              "outcome=\"none\"} 1\n"));
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
  *request.mutable_query() = test::ScanRequest(test::QueryScan(1, 1));
  v1::LocalizeStreamResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  request.set_max_step_m(1.0);  // of a stream's first request only: refused
  ASSERT_TRUE(stream->Write(request));
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  server_->Shutdown();  // both were counted
  const std::string text = server_->MetricsText();
  EXPECT_THAT(text, HasSubstr("scanloc_requests_total{code=\"INVALID_ARGUMENT\",method=\""
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
  *request.mutable_query() = test::ScanRequest(test::QueryScan(1, 1));
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

class CaptureTest : public ObservabilityTest {
 protected:
  [[nodiscard]] std::vector<std::filesystem::path> Files() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(dir_.path())) {
      files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
  }

  [[nodiscard]] ServerOptions Capturing() const {
    ServerOptions options = Options();
    options.capture_dir = dir_.path();
    return options;
  }

  /// A scan of another town, as large as is wanted.
  static v1::LocalizeRequest Lost(std::size_t num_more_points = 0) {
    PointCloud points = test::QueryScan(77, 3);
    points.insert(points.end(), num_more_points, points.front());
    return test::ScanRequest(points);
  }
};

TEST_F(CaptureTest, KeepsAQueryWithoutAPlaceAndWhatWasSaid) {
  Start(Capturing());
  const v1::LocalizeRequest request = Lost();
  ASSERT_TRUE(Ask(request, "robot 7").ok());  // a bad id: replaced
  ASSERT_TRUE(Ask(request, "../../robot-7").ok());
  server_.reset();  // writes what waits
  const auto files = Files();
  ASSERT_EQ(files.size(), 2U);
  EXPECT_THAT(files[1].filename().string(), HasSubstr("______robot-7.query"));
  v1::CapturedQuery query;
  std::ifstream file(files[1], std::ios::binary);
  ASSERT_TRUE(query.ParseFromIstream(&file));
  EXPECT_EQ(query.request_id(), "../../robot-7");
  EXPECT_EQ(query.request().SerializeAsString(), request.SerializeAsString());
  EXPECT_EQ(query.response().outcome(), v1::OUTCOME_NOT_RECOGNIZED);
  EXPECT_EQ(query.response().map(), "town");
  EXPECT_GT(query.received().seconds(), 1'600'000'000);
}

TEST_F(CaptureTest, KeepsWhatCanBeReadBackAndNoPieceOfItCan) {
  Start(Capturing());
  v1::LocalizeRequest request = Lost();
  request.set_map("town");
  request.mutable_options()->set_max_answers(7);
  ASSERT_TRUE(Ask(request, "robot-7").ok());
  server_.reset();
  ASSERT_EQ(Files().size(), 1U);
  const std::string bytes = test::ReadFile(Files().front());
  const auto query = proto::ParseCapturedQuery(bytes);
  ASSERT_TRUE(query.ok()) << query.status();
  EXPECT_EQ(query->request_id, "robot-7");
  EXPECT_EQ(query->map, "town");
  EXPECT_EQ(query->query.max_answers, 7);
  EXPECT_EQ(query->scan.size(), test::QueryScan(77, 3).size());
  EXPECT_EQ(query->reply.answer.outcome, Outcome::kNotRecognized);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (length > 300 && length + 300 < bytes.size()) continue;  // within the points
    // Cut between two fields it is a message still, but without a query or an answer.
    const auto piece = proto::ParseCapturedQuery(bytes.substr(0, length));
    EXPECT_EQ(piece.status().code(), absl::StatusCode::kInvalidArgument) << length;
  }
}

TEST_F(CaptureTest, KeepsNoQueryThatFoundItsPlace) {
  Start(Capturing());
  const v1::LocalizeRequest request =
      test::DescriptorRequest(test::QueryScan(1, 1), maps_.at("town").params);
  ASSERT_TRUE(Ask(request).ok());
  ASSERT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED);
  server_.reset();
  EXPECT_TRUE(Files().empty());
}

// Whoever sends scans of nothing would push out what tells something.
TEST_F(CaptureTest, KeepsNoScanOfNextToNothing) {
  Start(Capturing());
  ASSERT_TRUE(Ask(test::ScanRequest(PointCloud(9, Point{5.0F, 0.0F, 0.0F}))).ok());
  ASSERT_EQ(response_.outcome(), v1::OUTCOME_INSUFFICIENT_SCAN);
  server_.reset();
  EXPECT_TRUE(Files().empty());
}

/// What the folder's files take of the disk.
std::int64_t DiskBytes(const std::vector<std::filesystem::path>& files) {
  std::int64_t num_bytes = 0;
  for (const auto& path : files) {
    struct stat status = {};
    EXPECT_EQ(stat(path.c_str(), &status), 0);
    num_bytes += std::int64_t{status.st_blocks} * 512;
  }
  return num_bytes;
}

TEST_F(CaptureTest, BoundsTheFolderAndDropsTheOldest) {
  ServerOptions options = Capturing();
  options.max_capture_bytes = 1 << 20;
  const std::size_t num_points = Lost().scan().num_points();
  for (std::size_t start = 0; start < 3; ++start) {
    Start(options);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(Ask(Lost(20'000 + start - num_points)).ok());
    server_.reset();
    EXPECT_LE(DiskBytes(Files()), 1 << 20);
  }
  const auto files = Files();
  EXPECT_EQ(files.size(), 4U);  // 240 kB each
  v1::CapturedQuery newest;
  std::ifstream file(files.back(), std::ios::binary);
  ASSERT_TRUE(newest.ParseFromIstream(&file));
  EXPECT_EQ(newest.request().scan().num_points(), 20'002U);
}

// Of what the bound allows in bytes, small files take many times as much in blocks.
TEST_F(CaptureTest, BoundsWhatSmallFilesTakeOfTheDisk) {
  ServerOptions options = Capturing();
  options.max_capture_bytes = 1 << 20;
  for (int i = 0; i < 600; ++i) dir_.Write(std::to_string(i + 1000) + ".query", "small");
  Start(options);
  ASSERT_TRUE(Ask(Lost()).ok());
  server_.reset();
  EXPECT_LE(DiskBytes(Files()), 1 << 20);
  EXPECT_GT(Files().size(), 200U);
}

TEST_F(CaptureTest, LeavesOthersFilesAloneAndRemovesUnfinishedOnes) {
  const std::string theirs = dir_.File("notes.txt");
  std::ofstream(theirs) << "mine";
  const std::string unfinished = dir_.File("20260101T000000.000Z-000000-x.query.part");
  std::ofstream(unfinished) << "half";
  Start(Capturing());
  EXPECT_TRUE(std::filesystem::exists(theirs));
  EXPECT_FALSE(std::filesystem::exists(unfinished));
}

TEST_F(CaptureTest, MakesItsFolderAndRefusesOneThatCannotBe) {
  ServerOptions options = Options();
  options.capture_dir = dir_.File("missing/captures");
  Start(options);
  ASSERT_TRUE(Ask(Lost()).ok());
  server_.reset();
  EXPECT_EQ(std::filesystem::status(options.capture_dir).permissions(),
            std::filesystem::perms::owner_all);
  EXPECT_FALSE(std::filesystem::is_empty(options.capture_dir));

  options.capture_dir = dir_.Write("file", "no folder");
  const auto server = Server::Start(options, test::LoaderOf(maps_));
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(server.status().message()), HasSubstr(options.capture_dir));
}

}  // namespace
}  // namespace scanloc::server
