// Who may call a server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "scanloc/client/client.hpp"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kToken[] = "a-token-of-the-fleet-0001";
constexpr char kOther[] = "a-token-of-the-fleet-0002";

class TokensTest : public testing::Test {
 protected:
  TokensTest() { test::WriteSmallMap(map_, 1, 4); }

  [[nodiscard]] std::vector<std::string> Command(std::vector<std::string> arguments) const {
    std::vector<std::string> command = {test::BinDir() + "/scanlocd", "--map", "town=" + map_};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }

  void Start(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0"});
    scanlocd_.emplace(Command(arguments));
    const std::string line = scanlocd_->ReadLine();
    ASSERT_THAT(line, StartsWith("scanlocd ready on ")) << scanlocd_->stderr_text();
    options_.address = line.substr(line.rfind(' ') + 1);
  }

  /// Asks over a connection of its own.
  [[nodiscard]] absl::Status Ask() const {
    const auto client = client::Client::Connect(options_);
    if (!client.ok()) return client.status();
    return client->LocalizeScan(test::QueryScan(1, 2)).status();
  }

  test::TempDir dir_;
  std::string map_ = dir_.File("town.scanloc");
  std::optional<test::Process> scanlocd_;
  client::ClientOptions options_;
};

/// Writes beside the file, then renames, as an operator should.
void Replace(const test::TempDir& dir, const std::string& file, const std::string& content) {
  std::filesystem::rename(dir.Write("next", content), file);
}

TEST_F(TokensTest, AdmitsOnlyTokensOfTheFile) {
  const std::string tokens =
      dir_.Write("tokens", std::string("# the fleet\n\nfleet query ") + kToken + "\n");
  Start({"--token-file", tokens, "--log-level", "debug"});
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = kOther;
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = std::string(kToken) + "x";
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = kToken;
  EXPECT_TRUE(Ask().ok()) << Ask();

  Replace(dir_, tokens, std::string("fleet query ") + kOther + "\n");
  while (Ask().ok()) std::this_thread::yield();
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = kOther;
  EXPECT_TRUE(Ask().ok()) << Ask();

  Replace(dir_, tokens, "fleet emperor short\n");
  std::filesystem::last_write_time(tokens, std::filesystem::file_time_type::clock::now());
  options_.token = kToken;
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = kOther;
  EXPECT_TRUE(Ask().ok()) << "the tokens before stay in force";

  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), Not(HasSubstr(kToken)));
  EXPECT_THAT(scanlocd_->stderr_text(), Not(HasSubstr(kOther)));
}

TEST_F(TokensTest, EndsAStreamWhoseTokenIsWithdrawn) {
  const std::string tokens = dir_.Write("tokens", std::string("fleet query ") + kToken + "\n");
  Start({"--token-file", tokens});
  options_.token = kToken;
  const auto client = client::Client::Connect(options_);
  ASSERT_TRUE(client.ok()) << client.status();
  auto stream = client->OpenStream();
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE(stream->Locate(test::QueryScan(1, 2)).ok());
  Replace(dir_, tokens, std::string("fleet query ") + kOther + "\n");
  absl::Status status;
  while (status.ok()) status = stream->Locate(test::QueryScan(1, 2)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated) << status;
}

// Same size, same times: only what it holds is another.
TEST_F(TokensTest, WithdrawsATokenThatIsOverwrittenInPlace) {
  const std::string tokens = dir_.Write("tokens", std::string("fleet query ") + kToken + "\n");
  const auto written = std::filesystem::last_write_time(tokens);
  Start({"--token-file", tokens});
  options_.token = kToken;
  EXPECT_TRUE(Ask().ok()) << Ask();
  dir_.Write("tokens", std::string("fleet query ") + kOther + "\n");
  std::filesystem::last_write_time(tokens, written);
  while (Ask().ok()) std::this_thread::yield();
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
  options_.token = kOther;
  EXPECT_TRUE(Ask().ok()) << Ask();
}

TEST_F(TokensTest, TellsOfATokenFileThatCannotBeReadAndTakesItUpWhenItCan) {
  const std::string tokens = dir_.Write("tokens", std::string("fleet query ") + kToken + "\n");
  const test::Maps maps = {{"town", test::SmallMap(1, 4)}};
  ServerOptions server_options = test::OptionsFor(maps);
  server_options.token_file = tokens;
  const auto server = test::StartServer(maps, server_options);
  const auto await = [&](const std::string& line) {
    while (server->MetricsText().find(line) == std::string::npos) std::this_thread::yield();
  };
  await("scanloc_file_unusable{file=\"tokens\"} 0\n");
  options_ = {.address = server->address(), .token = kToken};
  std::filesystem::remove(tokens);
  await("scanloc_file_unusable{file=\"tokens\"} 1\n");
  EXPECT_TRUE(Ask().ok()) << Ask();
  dir_.Write("tokens", std::string("fleet query ") + kOther + "\n");
  await("scanloc_file_unusable{file=\"tokens\"} 0\n");
  EXPECT_EQ(Ask().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(TokensTest, RefusesABadTokenFileAtTheStart) {
  for (const std::string& content :
       {std::string("fleet query short"), std::string("fleet emperor ") + kToken,
        std::string("fleet ") + kToken, std::string("a query ") + kToken + " more",
        std::string("a query ") + kToken + "\nb admin " + kToken}) {
    test::Process scanlocd(
        Command({"--token-file", dir_.Write("tokens", content), "--listen", "127.0.0.1:0"}));
    EXPECT_EQ(scanlocd.Wait(), 1) << content;
    EXPECT_THAT(scanlocd.stderr_text(), HasSubstr("token file")) << content;
    EXPECT_THAT(scanlocd.stderr_text(), Not(HasSubstr(kToken)));
  }
  test::Process scanlocd(Command({"--token-file", dir_.File("none"), "--listen", "127.0.0.1:0"}));
  EXPECT_EQ(scanlocd.Wait(), 1);
}

}  // namespace
}  // namespace scanloc::server
