#include <sys/resource.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "metered_scanlocd.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class ScanlocdOperationTest : public MeteredScanlocdTest {};

TEST_F(ScanlocdOperationTest, ServesItsMetricsOverHttp) {
  StartMetered({"--map", "town=" + WriteMap("town", 1)});
  ASSERT_TRUE(Connect().LocalizeScan(test::QueryScan(1, 2)).ok());
  const std::string page = test::HttpGet(metrics_address_, "/metrics");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("scanloc_map_serving{map=\"town\"} 1"));
  EXPECT_THAT(page, HasSubstr("method=\"Localize\""));
  EXPECT_THAT(test::HttpGet(metrics_address_, "/elsewhere"), HasSubstr(" 404 "));
}

TEST_F(ScanlocdOperationTest, SurvivesGarbageOnTheMetricsPort) {
  StartMetered({"--map", "town=" + WriteMap("town", 1)});
  for (const std::string& bytes :
       {std::string(100'000, 'x'), std::string("\0\xff\x16\x03", 4), std::string("GET\r\n\r\n")}) {
    const test::TcpConnection connection(metrics_address_);
    connection.Send(bytes);
  }
  EXPECT_EQ(Metric("scanloc_in_flight"), 0.0);
}

TEST_F(ScanlocdOperationTest, ServesMetricsBesideSilentConnections) {
  StartMetered({"--map", "town=" + WriteMap("town", 1)});
  const test::TcpConnection first(metrics_address_);
  const test::TcpConnection second(metrics_address_);
  for (const test::TcpConnection* silent : {&first, &second})
    silent->Send("GET /metrics HTTP/1.0\r\n");
  EXPECT_EQ(Metric("scanloc_in_flight"), 0.0);
  // The silent ones have not been given up for it: they were not waited for.
  for (const test::TcpConnection* silent : {&first, &second}) {
    silent->Send("\r\n");
    EXPECT_THAT(silent->ReadAll(), HasSubstr("scanloc_in_flight 0"));
  }
}

TEST_F(ScanlocdOperationTest, GivesUpConnectionsThatSendNoWholeRequest) {
  StartMetered({"--map", "town=" + WriteMap("town", 1)});
  std::vector<std::unique_ptr<test::TcpConnection>> silent;
  for (int i = 0; i < 40; ++i) {
    silent.push_back(std::make_unique<test::TcpConnection>(metrics_address_));
    silent.back()->Send("GET /metrics HTTP/1.0\r\n");
  }
  EXPECT_EQ(Metric("scanloc_in_flight"), 0.0);
  EXPECT_TRUE(silent.back()->IsOpen()) << "nobody has to be given up before others are served";
  for (const auto& connection : silent) {
    EXPECT_THAT(connection->ReadAll(), Not(HasSubstr("scanloc_in_flight")));
  }
}

TEST_F(ScanlocdOperationTest, RefusesToServeMetricsToTheNetworkUnlessToldSo) {
  const std::vector<std::string> open = {"--map", "town=" + WriteMap("town", 1), "--metrics-listen",
                                         "0.0.0.0:0"};
  const test::ProcessResult refused = test::RunProcess(Command(open));
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("metrics on 0.0.0.0:0"));
  for (const char* flag : {"--allow-plaintext", "--allow-plaintext-metrics"}) {
    std::vector<std::string> allowed = open;
    allowed.emplace_back(flag);
    Start(allowed);
  }
}

TEST_F(ScanlocdOperationTest, TellsOnceThatQueriesCannotBeCaptured) {
  const std::string folder = dir_.File("captures");
  std::filesystem::create_directory(folder);
  Start({"--map", "town=" + WriteMap("town", 1), "--capture-dir", folder});
  std::filesystem::remove(folder);
  const client::Client client = Connect();
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(client.LocalizeScan(test::QueryScan(77, 3)).ok());
  }
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  std::istringstream lines(scanlocd_->stderr_text());
  int num_told = 0;
  for (std::string line; std::getline(lines, line);) {
    num_told += line.find("query not captured") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(num_told, 1);
  EXPECT_LE(num_told, 2);  // two where a minute ended meanwhile
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("No such file or directory"));
}

TEST_F(ScanlocdOperationTest, RefusesAFolderForCapturesThatIsAnothers) {
  const std::vector<std::string> arguments = {"--map", "town=" + WriteMap("town", 1),
                                              "--capture-dir", dir_.File("captures")};
  Start(arguments);
  std::vector<std::string> other = Command(arguments);
  other.insert(other.end(), {"--listen", "127.0.0.1:0"});
  const test::ProcessResult refused = test::RunProcess(other);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("is another server's"));
  scanlocd_->Signal(SIGKILL);
  scanlocd_->Wait();
  Start(arguments);
}

TEST_F(ScanlocdOperationTest, ServesOnWhenAFileIsAsLongAsFilesMayBe) {
  Start({"--map", "town=" + WriteMap("town", 1), "--capture-dir", dir_.File("captures")});
  const rlimit limit = {.rlim_cur = 100, .rlim_max = 100};
  ASSERT_EQ(prlimit(scanlocd_->pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
  const client::Client client = Connect();
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(client.LocalizeScan(test::QueryScan(77, 3)).ok());
  }
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("query not captured"));
}

TEST_F(ScanlocdOperationTest, LogsOneJsonObjectALine) {
  Start({"--map", "town=" + WriteMap("town", 1), "--log-format", "json", "--log-requests", "all"});
  const auto stub = v1::Localization::NewStub(test::ChannelTo(address_));
  for (const char* map : {"town", "no\"where\n"}) {
    grpc::ClientContext context;
    test::SetPatience(context);
    context.AddMetadata("x-request-id", "robot-7");
    v1::LocalizeResponse response;
    std::ignore =
        stub->Localize(&context, test::ScanRequest(test::QueryScan(1, 1), map), &response);
  }
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  std::istringstream lines(scanlocd_->stderr_text());
  std::vector<nlohmann::json> requests;
  for (std::string line; std::getline(lines, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(json.is_object()) << line;
    for (const char* field : {"time", "level", "message"})
      EXPECT_TRUE(json.contains(field)) << line;
    if (json["message"] == "request" && json["method"] == "Localize") requests.push_back(json);
  }
  ASSERT_EQ(requests.size(), 2U) << scanlocd_->stderr_text();
  EXPECT_EQ(requests[0]["request_id"], "robot-7");
  EXPECT_EQ(requests[0]["code"], "OK");
  EXPECT_TRUE(requests[0]["duration_ms"].is_number());
  EXPECT_EQ(requests[0]["map"], "town");
  EXPECT_TRUE(requests[0].contains("outcome"));
  EXPECT_NE(requests[1]["code"], "OK");
  EXPECT_TRUE(requests[1].contains("reason"));
}

TEST_F(ScanlocdOperationTest, ProbesWhetherAServerServes) {
  Start({"--map", "town=" + WriteMap("town", 1)});
  EXPECT_EQ(test::RunProcess(Command({"--probe", address_})).status, 0);
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  const test::ProcessResult gone = test::RunProcess(Command({"--probe", address_}));
  EXPECT_EQ(gone.status, 1);
  EXPECT_THAT(gone.err, HasSubstr(address_));
}

TEST_F(ScanlocdOperationTest, NeverLogsAToken) {
  const std::string tokens = dir_.Write("tokens", "robot query secret-secret-secret-1\n");
  Start({"--map", "town=" + WriteMap("town", 1), "--token-file", tokens, "--log-requests", "all",
         "--log-level", "debug"});
  for (const char* token : {"secret-secret-secret-1", "wrong-wrong-wrong-wrong"}) {
    auto client = client::Client::Connect({.address = address_, .token = token});
    ASSERT_TRUE(client.ok());
    std::ignore = client->ListMaps();
  }
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("client=token:robot"));
  EXPECT_THAT(scanlocd_->stderr_text(), testing::Not(HasSubstr("secret-secret")));
  EXPECT_THAT(scanlocd_->stderr_text(), testing::Not(HasSubstr("wrong-wrong")));
}

TEST_F(ScanlocdOperationTest, ReadsItsOptionsFromAFileAndTheCommandLineGoesBefore) {
  const std::string map = WriteMap("town", 1);
  const std::string config = dir_.Write("scanlocd.toml", "map = [\"town=" + map +
                                                             "\"]\nmax-points = 100\n"
                                                             "listen = \"no such host:0\"\n");
  Start({"--config", config});
  const absl::Status refused = Connect().LocalizeScan(test::QueryScan(1, 2)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
}

TEST_F(ScanlocdOperationTest, RefusesAConfigFileThatItDoesNotUnderstand) {
  const std::string map = "town=" + WriteMap("town", 1);
  for (const std::string& config :
       {dir_.Write("a.toml", "max-pionts = 100\n"), dir_.Write("b.toml", "max-points = \"many\"\n"),
        dir_.File("absent.toml"), std::string("/dev/zero")}) {
    test::Process scanlocd(Command({"--map", map, "--config", config}));
    EXPECT_EQ(scanlocd.Wait(), 2) << config;
    EXPECT_NE(scanlocd.stderr_text(), "");
  }
}

TEST_F(ScanlocdOperationTest, SaysInWhichLineOfTheConfigFileTheMistakeIs) {
  struct Case {
    const char* text;
    const char* told;
  };
  for (const auto& [text, told] :
       {Case{"# limits\n\nmax-pionts = 100\n", ":3: no option is named \"max-pionts\""},
        Case{"max-points = 100\n  max-inflight = \"many\"\n", ":2: "},
        Case{"max-points 100\n", ":1: "}, Case{"max-points = 1\n[limits]\nmax-rate = 1\n", ":2: "},
        Case{"allow-plaintext = \"\"\n", ":1: --allow-plaintext: its value is empty"},
        Case{"admin = 2024-01-01\n", ":1: --admin: its value is \"2024-01-01\"; it must"},
        Case{"admin = [true, true]\n", ":1: --admin: its value is \"true,true\"; it must be"},
        Case{"log-requests = \"most\"\n", ":1: --log-requests: most not in {none,failed,all}"}}) {
    const std::string config = dir_.Write("scanlocd.toml", text);
    const test::ProcessResult result =
        test::RunProcess(Command({"--map", "town=town.scanloc", "--config", config}));
    EXPECT_EQ(result.status, 2) << text;
    EXPECT_THAT(result.err, HasSubstr(config + told));
    EXPECT_THAT(result.err, Not(HasSubstr("INI")));
    EXPECT_THAT(result.err, Not(HasSubstr("->")));
  }
}

#ifndef SCANLOC_SANITIZED
TEST_F(ScanlocdOperationTest, SaysThatThereCanBeNoSoManyThreads) {
  const std::string map = WriteMap("town", 1);
  const test::ProcessResult result =
      test::RunProcess({"/bin/sh", "-c",
                        "ulimit -v 3000000; exec " + test::BinDir() +
                            "/scanlocd --threads 1000 --listen 127.0.0.1:0 --map town=" + map});
  EXPECT_EQ(result.status, 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("cannot start 1000 threads that answer queries"));
}
#endif

TEST_F(ScanlocdOperationTest, SaysThatTooFewFilesMayBeOpen) {
  const std::string map = WriteMap("town", 1);
  const test::ProcessResult result = test::RunProcess(
      {"/bin/sh", "-c",
       "ulimit -n 8; exec " + test::BinDir() + "/scanlocd --listen 127.0.0.1:0 --map town=" + map});
  EXPECT_EQ(result.status, 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("only 8 files and connections may be open"));
}

TEST_F(ScanlocdOperationTest, WarnsOfAHalfBuiltMap) {
  const std::string path = dir_.File("half.scanloc");
  test::WriteSmallMap(path, 1, 3, {}, /*num_left=*/2);
  Start({"--map", "half=" + path});
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("half built"));
}

// What a client or a map says cannot end a line, steer the terminal or turn what is read.
TEST_F(ScanlocdOperationTest, LogsForeignTextAsItMayBeShown) {
  const std::string name = "x\u202e\u009b31m\nforged line\x1b[31m";
  const std::string map = WriteMap("town", 1);
  for (const char* format : {"text", "json"}) {
    Start({"--map", "town=" + map, "--log-format", format});
    EXPECT_EQ(Connect().LocalizeScan(test::QueryScan(1, 1), {.map = name}).status().code(),
              absl::StatusCode::kNotFound);
    scanlocd_->Signal(SIGTERM);
    ASSERT_EQ(scanlocd_->Wait(), 0);
    const std::string log = scanlocd_->stderr_text();
    EXPECT_THAT(log, HasSubstr("forged line"));
    for (const char* bad : {"\u202e", "\u009b", "\x1b", "\nforged"}) {
      EXPECT_THAT(log, Not(HasSubstr(bad)));
    }
  }
}

TEST_F(ScanlocdOperationTest, SurvivesTenThousandConnectionsOpenedAndDropped) {
  StartMetered({"--map", "town=" + WriteMap("town", 1)});
  const client::Client client = Connect();
  ASSERT_TRUE(client.LocalizeScan(test::QueryScan(1, 2)).ok());
  const double num_before = Metric("process_open_fds");
  for (int i = 0; i < 10'000; ++i) {
    const test::TcpConnection connection(address_);
    if (i % 3 == 1) connection.Send("PRI * HTTP/2.0\r\n\r\nSM");
    if (i % 3 == 2) connection.Send("garbage");
  }
  EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2)).ok());
  AwaitMetric("process_open_fds", [=](double value) { return value <= num_before + 5; });
}

}  // namespace
}  // namespace scanloc::server
