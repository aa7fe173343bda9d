#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "scanloc/mapdb/map_file.hpp"
#include "scanlocd_fixture.hpp"
#include "support/raw_call.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Connection {
 public:
  explicit Connection(const std::string& address) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    const std::size_t colon = address.rfind(':');
    sockaddr_in to = {};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
    inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    if (connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) {
      close(fd_);
      throw std::runtime_error("cannot connect to " + address);
    }
  }
  ~Connection() { close(fd_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Send(const std::string& bytes) const {
    // The other side may have hung up: then there is nobody to send to.
    std::ignore = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

  /// All that comes until the other side hangs up.
  [[nodiscard]] std::string ReadAll() const {
    std::string all;
    char buffer[4096];
    for (ssize_t count = 0; (count = read(fd_, buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }

 private:
  int fd_;
};

std::string Get(const std::string& address, const std::string& path) {
  const Connection connection(address);
  connection.Send("GET " + path + " HTTP/1.0\r\n\r\n");
  return connection.ReadAll();
}

class ScanlocdOperationTest : public ScanlocdTest {
 protected:
  /// Also serves metrics, and tells where.
  void StartWithMetrics(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(),
                     {"--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0"});
    scanlocd_.emplace(Command(arguments), test::ProcessOptions{.merge_stderr = true});
    const std::string line = scanlocd_->ReadLineWith("metrics on http://");
    const std::size_t begin = line.find("127.0.0.1:");
    metrics_address_ = line.substr(begin, line.find('/', begin) - begin);
    const std::string ready = scanlocd_->ReadLineWith("scanlocd ready on ");
    address_ = ready.substr(std::string("scanlocd ready on ").size());
  }

  [[nodiscard]] double Metric(const std::string& name) const {
    std::istringstream lines(Get(metrics_address_, "/metrics"));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(name + " ")) return std::stod(line.substr(name.size()));
    }
    throw std::runtime_error("no metric " + name);
  }

  std::string metrics_address_;
};

TEST_F(ScanlocdOperationTest, ServesItsMetricsOverHttp) {
  StartWithMetrics({"--map", "town=" + WriteMap("town", 1)});
  ASSERT_TRUE(Connect().LocalizeScan(test::QueryScan(1, 2)).ok());
  const std::string page = Get(metrics_address_, "/metrics");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("scanloc_map_serving{map=\"town\"} 1"));
  EXPECT_THAT(page, HasSubstr("method=\"Localize\""));
  EXPECT_THAT(Get(metrics_address_, "/elsewhere"), HasSubstr(" 404 "));
}

TEST_F(ScanlocdOperationTest, SurvivesGarbageOnTheMetricsPort) {
  StartWithMetrics({"--map", "town=" + WriteMap("town", 1)});
  for (const std::string& bytes :
       {std::string(100'000, 'x'), std::string("\0\xff\x16\x03", 4), std::string("GET\r\n\r\n")}) {
    const Connection connection(metrics_address_);
    connection.Send(bytes);
  }
  EXPECT_EQ(Metric("scanloc_in_flight"), 0.0);
}

TEST_F(ScanlocdOperationTest, ServesMetricsBesideSilentConnections) {
  StartWithMetrics({"--map", "town=" + WriteMap("town", 1)});
  const Connection first(metrics_address_);
  const Connection second(metrics_address_);
  for (const Connection* silent : {&first, &second}) silent->Send("GET /metrics HTTP/1.0\r\n");
  EXPECT_EQ(Metric("scanloc_in_flight"), 0.0);
  // The silent ones have not been given up for it: they were not waited for.
  for (const Connection* silent : {&first, &second}) {
    silent->Send("\r\n");
    EXPECT_THAT(silent->ReadAll(), HasSubstr("scanloc_in_flight 0"));
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
    ASSERT_TRUE(client.LocalizeScan(PointCloud{{5.0F, 0.0F, 0.0F}}).ok());
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
        dir_.File("absent.toml")}) {
    test::Process scanlocd(Command({"--map", map, "--config", config}));
    EXPECT_EQ(scanlocd.Wait(), 2) << config;
    EXPECT_NE(scanlocd.stderr_text(), "");
  }
}

TEST_F(ScanlocdOperationTest, SurvivesTenThousandConnectionsOpenedAndDropped) {
  StartWithMetrics({"--map", "town=" + WriteMap("town", 1)});
  const client::Client client = Connect();
  ASSERT_TRUE(client.LocalizeScan(test::QueryScan(1, 2)).ok());
  const double num_before = Metric("process_open_fds");
  for (int i = 0; i < 10'000; ++i) {
    const Connection connection(address_);
    if (i % 3 == 1) connection.Send("PRI * HTTP/2.0\r\n\r\nSM");
    if (i % 3 == 2) connection.Send("garbage");
  }
  EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2)).ok());
  const auto patience = std::chrono::steady_clock::now() + test::Process::kPatience;
  while (Metric("process_open_fds") > num_before + 5) {
    ASSERT_LT(std::chrono::steady_clock::now(), patience) << Metric("process_open_fds");
    std::this_thread::yield();
  }
}

TEST_F(ScanlocdOperationTest, LeavesItsMapsWholeHoweverItIsKilledWhileLoading) {
  const std::string map = WriteMap("town", 1);
  const std::uint64_t num_bytes = std::filesystem::file_size(map);
  std::mt19937 random(7);
  for (int i = 0; i < 25; ++i) {
    Start({"--map", "town=" + map});
    // A new file each time, so that the reload really loads.
    test::WriteSmallMap(dir_.File("next"), static_cast<std::uint64_t>(i) + 2, kNumPlaces);
    std::filesystem::rename(dir_.File("next"), map);
    scanlocd_->Signal(SIGHUP);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));  // any moment will do
    scanlocd_->Signal(SIGKILL);
    EXPECT_EQ(scanlocd_->Wait(), -SIGKILL);
    EXPECT_TRUE(mapdb::LoadMap(map).ok()) << mapdb::LoadMap(map).status();
  }
  EXPECT_NEAR(static_cast<double>(std::filesystem::file_size(map)), static_cast<double>(num_bytes),
              0.5 * static_cast<double>(num_bytes));
}

}  // namespace
}  // namespace scanloc::server
