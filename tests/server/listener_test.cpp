#include "front/listener.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "metered_scanlocd.hpp"
#include "support/tcp_connection.hpp"

namespace scanloc::server {
namespace {

using test::TcpConnection;

class ListenerTest : public testing::Test {
 protected:
  static constexpr int kMaxConnections = 4;

  ~ListenerTest() override {
    listener_->HangUp();
    for (const int socket : sockets_) close(socket);
  }

  void LetIn() {
    listener_->LetIn([this](int socket) {
      const std::lock_guard lock(mutex_);
      sockets_.push_back(socket);
    });
  }

  void AwaitLetIn(std::size_t number) {
    Await("connections are let in", [&] {
      const std::lock_guard lock(mutex_);
      return sockets_.size() == number;
    });
  }

  [[nodiscard]] TcpConnection Connect(const char* from = nullptr) {
    TcpConnection connection(listener_->address(), from);
    AwaitLetIn(++num_connected_);
    return connection;
  }

  /// Whether the other side has not hung up.
  [[nodiscard]] static bool IsOpen(const TcpConnection& connection) {
    connection.SetPatience(std::chrono::milliseconds(1));
    return connection.SendSome("x").has_value() && connection.IsOpen();
  }

  std::unique_ptr<Listener> listener_ = Listener::Open("127.0.0.1:0", kMaxConnections).value();
  std::mutex mutex_;
  std::vector<int> sockets_;  // let in
  std::size_t num_connected_ = 0;
};

TEST_F(ListenerTest, KeepsWhoComesWaitingUntilItLetsIn) {
  const TcpConnection early(listener_->address());
  EXPECT_EQ(listener_->num_connections(), 0);
  LetIn();
  AwaitLetIn(1);
  EXPECT_EQ(listener_->num_connections(), 1);
}

TEST_F(ListenerTest, GivesThePlaceOfWhoHasLongBeenSilent) {
  LetIn();
  const TcpConnection silent = Connect();
  std::vector<TcpConnection> others;
  for (int i = 1; i < kMaxConnections; ++i) others.push_back(Connect());
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the silence that is meant
  for (const TcpConnection& other : others) other.Send("here");
  const TcpConnection last = Connect();
  Await("the silent one is hung up on", [&] { return !IsOpen(silent); });
  for (const TcpConnection& other : others) EXPECT_TRUE(IsOpen(other));
  EXPECT_TRUE(IsOpen(last));
}

TEST_F(ListenerTest, TakesNoPlaceFromWhoHasFew) {
  LetIn();
  const TcpConnection lone = Connect("127.0.0.2");
  std::vector<TcpConnection> crowd;
  for (int i = 0; i < 3 * kMaxConnections; ++i) crowd.push_back(Connect());
  EXPECT_TRUE(IsOpen(lone));
  EXPECT_EQ(listener_->num_connections(), kMaxConnections);
}

TEST_F(ListenerTest, LearnsThatAConnectionHasEnded) {
  LetIn();
  const TcpConnection connection = Connect();
  shutdown(sockets_.front(), SHUT_RDWR);  // as gRPC does before it closes
  Await("the connection is forgotten", [&] { return listener_->num_connections() == 0; });
}

TEST_F(ListenerTest, EndsAllConnectionsAndThenNewOnesWait) {
  LetIn();
  const TcpConnection connection = Connect();
  listener_->HangUp();
  Await("the connection is ended", [&] { return !IsOpen(connection); });
  const TcpConnection next(listener_->address());
  LetIn();
  AwaitLetIn(2);
}

TEST_F(ListenerTest, HangsUpOnTheSilentOnceItIsClosed) {
  LetIn();
  const TcpConnection silent = Connect();
  const TcpConnection alive = Connect();
  listener_->Close(std::chrono::milliseconds(300), std::chrono::hours(1));
  Await("the silent one is hung up on", [&] {
    alive.Send("here");
    return !silent.IsOpen();
  });
  EXPECT_TRUE(IsOpen(alive));
  EXPECT_THROW(TcpConnection(listener_->address()), std::runtime_error);
}

TEST(Listener, TellsWhyItCannotListen) {
  const auto first = Listener::Open("127.0.0.1:0", 1);
  ASSERT_TRUE(first.ok()) << first.status();
  for (const std::string& listen : {(*first)->address(), std::string("192.0.2.1:0")}) {
    const auto listener = Listener::Open(listen, 1);
    EXPECT_EQ(listener.status().code(), absl::StatusCode::kUnavailable) << listen;
    EXPECT_THAT(std::string(listener.status().message()), testing::HasSubstr(listen));
  }
}

TEST(Listener, IsReachedByTheMachineItself) {
  for (const auto& [listen, own] : std::vector<std::pair<std::string, std::string>>{
           {"127.0.0.1:0", "127.0.0.1:"}, {"localhost:0", ""}, {"0.0.0.0:0", ""}}) {
    const auto listener = Listener::Open(listen, 1);
    ASSERT_TRUE(listener.ok()) << listener.status();
    EXPECT_THAT((*listener)->own_address(), testing::StartsWith(own));
    EXPECT_THAT((*listener)->address(), testing::StartsWith(listen.substr(0, listen.size() - 1)));
    const std::string port = (*listener)->address().substr((*listener)->address().rfind(':'));
    const TcpConnection connection("127.0.0.1" + port);
  }
}

}  // namespace
}  // namespace scanloc::server
