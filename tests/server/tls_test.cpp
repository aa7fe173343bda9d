// Encrypted connections, with certificates made for the test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "scanloc/client/client.hpp"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

/// A CA, a certificate of 127.0.0.1 for the server, one for a robot, and a stranger's own.
class TlsTest : public testing::Test {
 protected:
  void SetUp() override {
    MakeCa("ca");
    MakeCa("stranger");
    Issue("server", "ca");
    Issue("robot", "ca");
    Issue("intruder", "stranger");
  }

  void MakeCa(const std::string& name) const {
    Run("openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=" + name + " -keyout " +
        Path(name + ".key") + " -out " + Path(name + ".pem"));
  }
  void Issue(const std::string& name, const std::string& ca, int days = 2) const {
    dir_.Write("san.cnf", "subjectAltName=IP:127.0.0.1,DNS:scanlocd.example\n");
    Run("openssl req -newkey rsa:2048 -nodes -subj /CN=" + name + " -keyout " +
        Path(name + ".key") + " -out " + Path(name + ".csr"));
    Run("openssl x509 -req -days " + std::to_string(days) + " -in " + Path(name + ".csr") +
        " -CA " + Path(ca + ".pem") + " -CAkey " + Path(ca + ".key") +
        " -CAcreateserial -extfile " + Path("san.cnf") + " -out " + Path(name + ".pem"));
  }
  [[nodiscard]] std::string Path(const std::string& name) const { return dir_.File(name); }
  static void Run(const std::string& command) {
    if (std::system((command + " 2>/dev/null").c_str()) != 0) throw std::runtime_error(command);
  }

  /// Unix time [s].
  [[nodiscard]] double ExpiryOf(const std::string& name) const {
    Run("date -d \"$(openssl x509 -noout -enddate -in " + Path(name + ".pem") +
        " | cut -d= -f2)\" +%s > " + Path("expiry"));
    return std::stod(test::ReadFile(Path("expiry")));
  }
  static double ExpiryTold(const Server& server) {
    const std::string text = server.MetricsText();
    const std::string name = "\nscanloc_tls_expiry_seconds ";
    return std::stod(text.substr(text.find(name) + name.size()));
  }
  static void AwaitFailures(const Server& server, int count) {
    const std::string line = "scanloc_tls_reload_failures_total " + std::to_string(count) + "\n";
    while (server.MetricsText().find(line) == std::string::npos) std::this_thread::yield();
  }

  [[nodiscard]] std::unique_ptr<Server> Start(bool is_mutual) const {
    const test::Maps maps = {{"town", test::SmallMap(1, 4)}};
    ServerOptions options = test::OptionsFor(maps);
    options.tls = {Path("server.pem"), Path("server.key"), is_mutual ? Path("ca.pem") : ""};
    return test::StartServer(maps, options);
  }
  [[nodiscard]] absl::Status Ask(const Server& server, const std::string& ca,
                                 const std::string& own = "") const {
    client::ClientOptions options{.address = server.address()};
    if (!ca.empty()) options.tls_ca_file = Path(ca + ".pem");
    if (!own.empty()) {
      options.tls_cert_file = Path(own + ".pem");
      options.tls_key_file = Path(own + ".key");
    }
    const auto client = client::Client::Connect(options);
    if (!client.ok()) return client.status();
    return client->LocalizeScan(test::QueryScan(1, 2)).status();
  }

  test::TempDir dir_;
};

TEST_F(TlsTest, AnswersClientsThatTrustItsCertificate) {
  const auto server = Start(false);
  EXPECT_TRUE(Ask(*server, "ca").ok()) << Ask(*server, "ca");
  EXPECT_EQ(Ask(*server, "stranger").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Ask(*server, "").code(), absl::StatusCode::kUnavailable);
}

TEST_F(TlsTest, OfBothSidesLetsOnlyItsOwnRobotsIn) {
  const auto server = Start(true);
  EXPECT_TRUE(Ask(*server, "ca", "robot").ok()) << Ask(*server, "ca", "robot");
  EXPECT_EQ(Ask(*server, "ca").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Ask(*server, "ca", "intruder").code(), absl::StatusCode::kUnavailable);
}

TEST_F(TlsTest, IsNoHindranceToItsOwnWatchdog) {
  for (const bool is_mutual : {false, true}) {
    const auto server = Start(is_mutual);
    const std::string answered = "scanloc_self_checks_total{result=\"answered\"} ";
    while (server->MetricsText().find(answered) == std::string::npos) std::this_thread::yield();
    EXPECT_EQ(server->MetricsText().find("result=\"unanswered\""), std::string::npos);
  }
}

TEST_F(TlsTest, TakesUpARenewedCertificate) {
  const auto server = Start(false);
  EXPECT_TRUE(Ask(*server, "ca").ok());
  Issue("server", "stranger");
  while (!Ask(*server, "stranger").ok()) std::this_thread::yield();  // some seconds
  EXPECT_EQ(Ask(*server, "ca").code(), absl::StatusCode::kUnavailable);
}

TEST_F(TlsTest, KeepsItsCertificateWhileANewOneIsBad) {
  const auto server = Start(false);
  const std::string old_key = test::ReadFile(Path("server.key"));
  EXPECT_THAT(server->MetricsText(), HasSubstr("scanloc_tls_reload_failures_total 0\n"));
  EXPECT_EQ(ExpiryTold(*server), ExpiryOf("server"));

  Issue("server", "stranger");
  dir_.Write("server.key", old_key);  // not its own
  AwaitFailures(*server, 1);
  EXPECT_TRUE(Ask(*server, "ca").ok()) << Ask(*server, "ca");
  Issue("server", "stranger");
  dir_.Write("server.key", old_key);  // again
  AwaitFailures(*server, 2);
  dir_.Write("server.pem", "-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n");
  AwaitFailures(*server, 3);
  EXPECT_TRUE(Ask(*server, "ca").ok()) << Ask(*server, "ca");
  std::filesystem::remove(Path("server.pem"));
  AwaitFailures(*server, 4);
  EXPECT_TRUE(Ask(*server, "ca").ok()) << Ask(*server, "ca");

  Issue("server", "stranger", 9);
  while (!Ask(*server, "stranger").ok()) std::this_thread::yield();
  EXPECT_EQ(Ask(*server, "ca").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ExpiryTold(*server), ExpiryOf("server"));
}

TEST_F(TlsTest, TakesUpANewCaOfItsClients) {
  const auto server = Start(true);
  std::filesystem::copy_file(Path("ca.pem"), Path("servers-ca.pem"));
  EXPECT_EQ(Ask(*server, "servers-ca", "intruder").code(), absl::StatusCode::kUnavailable);
  dir_.Write("ca.pem", "-----BEGIN CERTIFICATE-----\n");
  AwaitFailures(*server, 1);
  EXPECT_TRUE(Ask(*server, "servers-ca", "robot").ok());
  dir_.Write("ca.pem", test::ReadFile(Path("stranger.pem")));
  while (!Ask(*server, "servers-ca", "intruder").ok()) std::this_thread::yield();
  EXPECT_EQ(Ask(*server, "servers-ca", "robot").code(), absl::StatusCode::kUnavailable);
}

TEST_F(TlsTest, ChecksTheNameThatTheClientIsToldToExpect) {
  const auto server = Start(false);
  client::ClientOptions options{.address = server->address(), .tls_ca_file = Path("ca.pem")};
  options.tls_server_name = "scanlocd.example";
  EXPECT_TRUE(client::Client::Connect(options).ok());
  options.tls_server_name = "other.example";
  const absl::Status other = client::Client::Connect(options).status();
  EXPECT_EQ(other.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(other.message()), HasSubstr("is not in peer certificate"));
  options.tls_ca_file.clear();
  EXPECT_EQ(client::Client::Connect(options).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(TlsTest, IsProbedOverTls) {
  const auto server = Start(false);
  const auto mutual = Start(true);
  const auto probe = [&](const Server& of, std::vector<std::string> options) {
    std::vector<std::string> command = {test::BinDir() + "/scanlocd", "--probe", of.address()};
    command.insert(command.end(), options.begin(), options.end());
    const test::ProcessResult result = test::RunProcess(command);
    EXPECT_TRUE(result.status == 0 || result.status == 1) << result.err;
    return result.status == 0;
  };
  const std::vector<std::string> own = {"--tls-cert", Path("server.pem"), "--tls-key",
                                        Path("server.key")};
  EXPECT_TRUE(probe(*server, own));
  EXPECT_TRUE(probe(*server, {"--tls-ca", Path("ca.pem")}));
  EXPECT_FALSE(probe(*server, {"--tls-ca", Path("stranger.pem")}));
  EXPECT_FALSE(probe(*server, {}));
  EXPECT_TRUE(probe(*mutual, own));
  EXPECT_FALSE(probe(*mutual, {"--tls-ca", Path("ca.pem")}));
  EXPECT_FALSE(probe(*mutual, {"--tls-ca", Path("absent")}));
}

TEST_F(TlsTest, LogsWhyAHandshakeFailed) {
  const std::string map = Path("town.scanloc");
  test::WriteSmallMap(map, 1, 2);
  test::Process scanlocd({test::BinDir() + "/scanlocd", "--map", "town=" + map, "--listen",
                          "127.0.0.1:0", "--tls-cert", Path("server.pem"), "--tls-key",
                          Path("server.key"), "--tls-client-ca", Path("ca.pem")});
  const std::string ready = scanlocd.ReadLine();
  const std::string address = ready.substr(ready.rfind(' ') + 1);
  client::ClientOptions options{.address = address, .tls_ca_file = Path("ca.pem")};
  const auto ask = [&] {
    const auto client = client::Client::Connect(options);
    return client.ok() ? client->ListMaps().status() : client.status();
  };
  EXPECT_FALSE(ask().ok());  // shows no certificate
  options.tls_cert_file = Path("intruder.pem");
  options.tls_key_file = Path("intruder.key");
  EXPECT_FALSE(ask().ok());  // one of another CA
  options = {.address = address};
  EXPECT_FALSE(ask().ok());  // speaks without TLS
  scanlocd.Signal(SIGTERM);
  EXPECT_EQ(scanlocd.Wait(), 0);
  for (const char* meaning : {"shows no certificate", "not of --tls-client-ca", "without TLS"}) {
    EXPECT_THAT(scanlocd.stderr_text(), HasSubstr(meaning));
  }
}

TEST_F(TlsTest, IsRefusedAtTheStartWithFilesThatAreNone) {
  const test::Maps maps = {{"town", test::SmallMap(1, 2)}};
  ServerOptions options = test::OptionsFor(maps);
  for (const std::string& bad : {Path("absent"), dir_.Write("text", "not a certificate")}) {
    options.tls = {bad, Path("server.key"), ""};
    const auto server = Server::Start(options, test::LoaderOf(maps));
    EXPECT_EQ(server.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(server.status().message()), HasSubstr(bad));
    EXPECT_EQ(
        client::Client::Connect({.address = "127.0.0.1:1", .tls_ca_file = bad}).status().code(),
        absl::StatusCode::kInvalidArgument);
  }
  options.tls = {Path("server.pem"), Path("robot.key"), ""};
  EXPECT_THAT(std::string(Server::Start(options, test::LoaderOf(maps)).status().message()),
              HasSubstr("does not belong to"));
  EXPECT_EQ(client::Client::Connect({.address = "127.0.0.1:1", .tls_cert_file = Path("robot.pem")})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace scanloc::server
