// A real server whose wall clock is set while it works.
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "metered_scanlocd.hpp"
#include "support/http2.hpp"
#include "support/scan_files.hpp"

namespace scanloc::server {
namespace {

constexpr std::int64_t kDay_s = 86'400;
constexpr std::int64_t kYear_s = 365 * kDay_s;
constexpr char kCaptured[] = "scanloc_captures_total{result=\"kept\"}";

/// How many seconds the server's clock runs ahead of the test's.
class ServerClock {
 public:
  explicit ServerClock(const test::TempDir& dir) : path_(dir.File("clock")) { Set(0); }

  void Set(std::int64_t offset_s) const {
    // In place: the server has mapped the file.
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    if (!file) file.open(path_, std::ios::binary | std::ios::out);
    file.write(reinterpret_cast<const char*>(&offset_s), sizeof offset_s);
    file.close();
    if (!file) throw std::runtime_error("cannot set the clock");
  }

  [[nodiscard]] test::ProcessOptions Options() const {
    const char* asan = std::getenv("ASAN_OPTIONS");
    return {.environment = {"LD_PRELOAD=" + test::BinDir() + "/libscanloc_clock_shift.so",
                            "SCANLOC_CLOCK_OFFSET_FILE=" + path_,
                            // The preloaded library comes before the sanitizer's.
                            std::string("ASAN_OPTIONS=verify_asan_link_order=0:") +
                                (asan == nullptr ? "" : asan)}};
  }

 private:
  std::string path_;
};

/// The year that it is then.
std::string YearAt(std::int64_t offset_s) {
  const std::time_t then = std::time(nullptr) + offset_s;
  std::tm utc = {};
  gmtime_r(&then, &utc);
  return std::to_string(1900 + utc.tm_year);
}

class ClockJumpTest : public MeteredScanlocdTest {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(test::BinDir() + "/libscanloc_clock_shift.so")) {
      FAIL() << "the library that shifts clocks is not built";
    }
    SetTokens(kQueryToken);
    std::filesystem::create_directory(dir_.File("captures"));
    StartMetered({"--map", "town=" + WriteMap("town", 1), "--token-file", tokens_, "--capture-dir",
                  dir_.File("captures"), "--log-format", "json", "--max-rate", "2000",
                  "--drain-seconds", "1"},
                 clock_.Options());
  }

  /// The file as an operator changes it, in one step.
  void SetTokens(const std::string& token) const {
    std::filesystem::rename(dir_.Write("next", "robot query " + token + "\n"), tokens_);
  }

  [[nodiscard]] static absl::Status Ask(const client::Client& client) {
    return client.LocalizeScan(test::QueryScan(1, 2), {.timeout = std::chrono::seconds(30)})
        .status();
  }

  const ServerClock clock_{dir_};
  const std::string tokens_ = dir_.File("tokens");
};

TEST_F(ClockJumpTest, ChangesNothingForQueriesTokensMetricsRatesAndCaptures) {
  std::atomic<bool> is_over = false;
  std::atomic<int> num_answered = 0;
  // The token they began with is good all the time.
  const std::string both = std::string(kQueryToken) + "\nother query ";
  SetTokens(both + "a-token-of-the-first-day");
  std::vector<std::thread> robots;
  for (int i = 0; i < 2; ++i) {
    robots.emplace_back([&] {
      const client::Client robot = ConnectAs(kQueryToken);
      auto stream = robot.OpenStream();
      EXPECT_TRUE(stream.ok()) << stream.status();
      while (!is_over) {
        const absl::Status status = Ask(robot);
        EXPECT_TRUE(status.ok()) << status;
        const auto tracked = stream->Locate(test::QueryScan(1, 2));
        EXPECT_TRUE(tracked.ok()) << tracked.status();
        if (!status.ok() || !tracked.ok()) return;
        ++num_answered;
      }
    });
  }
  int round = 0;
  for (const std::int64_t offset_s : {kDay_s, -kDay_s, 10 * kYear_s, -10 * kYear_s}) {
    SCOPED_TRACE(offset_s);
    clock_.Set(offset_s);
    const int answered_by_then = num_answered;
    Await("answers", [&] { return num_answered >= answered_by_then + 20; });
    // A token that is new since then is known, and the log tells the time as it is there.
    const std::string token = "a-token-of-another-day-" + std::to_string(++round);
    SetTokens(both + token);
    const client::Client renewed = ConnectAs(token);
    Await("the new token", [&] { return Ask(renewed).ok(); });
    EXPECT_THAT(Log(), testing::HasSubstr("\"time\":\"" + YearAt(offset_s)));
    // A query without a place is kept.
    EXPECT_TRUE(renewed.LocalizeScan(test::QueryScan(77, 3)).ok());
    AwaitMetric(kCaptured, [=](double value) { return value >= round; });
  }
  is_over = true;
  for (std::thread& robot : robots) robot.join();
  AwaitMetric("scanloc_in_flight", [](double value) { return value == 0.0; });
  ExpectStopsWell();
}

TEST_F(ClockJumpTest, DoesNotHoldUpTheDrain) {
  // A call whose message never comes is cancelled only once the drain time has passed.
  const test::TcpConnection call(address_);
  call.Send(test::Http2CallOpening("/scanloc.v1.Localization/Localize", kQueryToken));
  ASSERT_TRUE(call.AwaitSomething());
  ASSERT_TRUE(Ask(ConnectAs(kQueryToken)).ok());
  clock_.Set(10 * kYear_s);
  scanlocd_->Signal(SIGTERM);
  AwaitMetric("scanloc_draining", [](double value) { return value == 1.0; });
  clock_.Set(-10 * kYear_s);
  EXPECT_EQ(scanlocd_->Wait(), 0) << Log();
}

TEST_F(ClockJumpTest, DoesNotShutOutAClientThatIsHeldToItsRate) {
  scanlocd_->Signal(SIGTERM);
  ASSERT_EQ(scanlocd_->Wait(), 0);
  StartMetered(
      {"--map", "town=" + dir_.File("town.scanloc"), "--token-file", tokens_, "--max-rate", "5"},
      clock_.Options());
  const auto client = client::Client::Connect(
      {.address = address_, .token = kQueryToken, .retry = {.max_attempts = 1}});
  ASSERT_TRUE(client.ok()) << client.status();
  for (const std::int64_t offset_s : {kDay_s, -10 * kYear_s}) {
    clock_.Set(offset_s);
    Await("a refusal", [&] { return absl::IsResourceExhausted(Ask(*client)); });
    Await("an answer", [&] { return Ask(*client).ok(); });
  }
  ExpectStopsWell();
}

}  // namespace
}  // namespace scanloc::server
