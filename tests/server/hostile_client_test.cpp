#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

/// A TCP connection without any protocol.
class Socket {
 public:
  explicit Socket(const std::string& address) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in peer = {};
    peer.sin_family = AF_INET;
    peer.sin_port = htons(std::stoi(address.substr(address.rfind(':') + 1)));
    peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd_, reinterpret_cast<const sockaddr*>(&peer), sizeof(peer)) != 0) std::abort();
  }
  ~Socket() { close(fd_); }
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket(const Socket&) = delete;

  /// The server may hang up meanwhile.
  void Send(const std::string& bytes) const {
    (void)send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

  /// Ends with a reset instead of a goodbye.
  void Reset() const {
    const linger hard = {.l_onoff = 1, .l_linger = 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &hard, sizeof(hard));
  }

 private:
  int fd_;
};

std::string Frame(char type, char flags, int stream, const std::string& payload,
                  std::size_t announced) {
  std::string frame;
  for (const int shift : {16, 8, 0}) frame += static_cast<char>(announced >> shift);
  frame += type;
  frame += flags;
  for (const int shift : {24, 16, 8, 0}) frame += static_cast<char>(stream >> shift);
  return frame + payload;
}

/// The opening of an HTTP/2 connection with a call of Localize, up to its message.
std::string CallOpening() {
  const auto literal = [](const std::string& name, const std::string& value) {
    return std::string(1, '\0') + static_cast<char>(name.size()) + name +
           static_cast<char>(value.size()) + value;
  };
  const std::string headers = literal(":method", "POST") + literal(":scheme", "http") +
                              literal(":path", "/scanloc.v1.Localization/Localize") +
                              literal(":authority", "localhost") + literal("te", "trailers") +
                              literal("content-type", "application/grpc");
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(4, 0, 0, "", 0) +
         Frame(1, 4, 1, headers, headers.size());
}

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
  std::string message(1, '\0');  // not compressed
  for (const int shift : {24, 16, 8, 0}) message += static_cast<char>(24'000 >> shift);
  message += request;
  for (const bool hard : {false, true}) {
    const Socket whole(server_->address());
    whole.Send(call + Frame(0, 0, 1, message, message.size()));
    if (hard) whole.Reset();
    const Socket torn(server_->address());
    torn.Send(call + Frame(0, 0, 1, message.substr(0, 500), message.size()));
    if (hard) torn.Reset();
  }
  for (std::size_t length = 0; length < call.size(); length += 7) {
    Socket(server_->address()).Send(call.substr(0, length));
  }
}

TEST_F(HostileClientTest, MayAnnounceAMessageOfFourGigabytes) {
  std::string message(1, '\0');
  message += std::string(4, '\xff');
  const Socket socket(server_->address());
  socket.Send(CallOpening() + Frame(0, 0, 1, message, message.size()));
}

TEST_F(HostileClientTest, MayHoldConnectionsOpenAndSilent) {
  std::vector<Socket> sockets;
  for (int i = 0; i < 200; ++i) sockets.emplace_back(server_->address());
  for (std::size_t i = 0; i < sockets.size(); i += 2) sockets[i].Send(CallOpening());
  HostileClientTest::TearDown();
}

}  // namespace
}  // namespace scanloc::server
