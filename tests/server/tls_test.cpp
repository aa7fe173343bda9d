// Encrypted connections, with certificates made for the test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include "scanloc/client/client.hpp"
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
  void Issue(const std::string& name, const std::string& ca) const {
    dir_.Write("san.cnf", "subjectAltName=IP:127.0.0.1\n");
    Run("openssl req -newkey rsa:2048 -nodes -subj /CN=" + name + " -keyout " +
        Path(name + ".key") + " -out " + Path(name + ".csr"));
    Run("openssl x509 -req -days 2 -in " + Path(name + ".csr") + " -CA " + Path(ca + ".pem") +
        " -CAkey " + Path(ca + ".key") + " -CAcreateserial -extfile " + Path("san.cnf") + " -out " +
        Path(name + ".pem"));
  }
  [[nodiscard]] std::string Path(const std::string& name) const { return dir_.File(name); }
  static void Run(const std::string& command) {
    if (std::system((command + " 2>/dev/null").c_str()) != 0) throw std::runtime_error(command);
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

TEST_F(TlsTest, TakesUpARenewedCertificate) {
  const auto server = Start(false);
  EXPECT_TRUE(Ask(*server, "ca").ok());
  Issue("server", "stranger");
  while (!Ask(*server, "stranger").ok()) std::this_thread::yield();  // some seconds
  EXPECT_EQ(Ask(*server, "ca").code(), absl::StatusCode::kUnavailable);
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
