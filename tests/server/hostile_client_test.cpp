#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "support/http2.hpp"
#include "support/raw_call.hpp"
#include "support/raw_http2.hpp"
#include "support/small_map.hpp"
#include "support/tcp_connection.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using Socket = test::TcpConnection;
using test::Http2Frame;

constexpr const char* kLocalize = "/scanloc.v1.Localization/Localize";

/// The opening of a connection with a call of Localize, up to its message.
std::string CallOpening() { return test::Http2CallOpening(kLocalize); }

class HostileClientTest : public testing::Test {
 protected:
  void TearDown() override {
    const auto stub = v1::Localization::NewStub(test::ChannelTo(server_->address()));
    v1::LocalizeResponse response;
    const grpc::Status status =
        test::Localize(*stub, test::ScanRequest(test::QueryScan(1, 2)), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.candidates(0).place(), 2);
  }

  std::unique_ptr<Server> server_ = test::StartServer({{"town", test::SmallMap(1, 4)}});
};

TEST_F(HostileClientTest, MaySendGarbage) {
  std::mt19937 random(5);
  for (int i = 0; i < 30; ++i) {
    const Socket socket(server_->address());
    std::string garbage(random() % 5000, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    socket.Send(garbage);
  }
}

TEST_F(HostileClientTest, MaySpeakAnotherProtocol) {
  Socket(server_->address()).Send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  Socket(server_->address()).Send(std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11));
}

TEST_F(HostileClientTest, MayHangUpInTheMiddleOfAMessage) {
  const std::string call = CallOpening();
  const std::string request =
      test::ScanRequest(test::QueryScan(1, 2)).SerializeAsString().substr(0, 10'000);
  const std::string message = test::GrpcMessage(24'000, request);
  for (const bool hard : {false, true}) {
    const Socket whole(server_->address());
    whole.Send(call + Http2Frame(0, 0, 1, message, message.size()));
    if (hard) whole.ResetAtEnd();
    const Socket torn(server_->address());
    torn.Send(call + Http2Frame(0, 0, 1, message.substr(0, 500), message.size()));
    if (hard) torn.ResetAtEnd();
  }
  for (std::size_t length = 0; length < call.size(); length += 7) {
    Socket(server_->address()).Send(call.substr(0, length));
  }
}

TEST_F(HostileClientTest, MayAnnounceAMessageOfFourGigabytes) {
  const std::string message = test::GrpcMessage(0xffffffff, "");
  const Socket socket(server_->address());
  socket.Send(CallOpening() + Http2Frame(0, 0, 1, message, message.size()));
}

TEST_F(HostileClientTest, MayHoldConnectionsOpenAndSilent) {
  std::vector<Socket> sockets;
  for (int i = 0; i < 200; ++i) sockets.emplace_back(server_->address());
  for (std::size_t i = 0; i < sockets.size(); i += 2) sockets[i].Send(CallOpening());
  HostileClientTest::TearDown();
}

}  // namespace
}  // namespace scanloc::server
