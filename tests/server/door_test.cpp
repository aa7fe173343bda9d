#include "door.hpp"

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

class DoorTest : public testing::Test {
 protected:
  static constexpr int kMaxConnections = 4;

  ~DoorTest() override {
    door_->HangUp();
    for (const int socket : sockets_) close(socket);
  }

  void LetIn() {
    door_->LetIn([this](int socket) {
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
    TcpConnection connection(door_->address(), from);
    AwaitLetIn(++num_connected_);
    return connection;
  }

  /// Whether the other side has not hung up.
  [[nodiscard]] static bool IsOpen(const TcpConnection& connection) {
    connection.SetPatience(std::chrono::milliseconds(1));
    return connection.SendSome("x").has_value() && connection.IsOpen();
  }

  std::unique_ptr<Door> door_ = Door::Open("127.0.0.1:0", kMaxConnections).value();
  std::mutex mutex_;
  std::vector<int> sockets_;  // let in
  std::size_t num_connected_ = 0;
};

TEST_F(DoorTest, KeepsWhoComesWaitingUntilItLetsIn) {
  const TcpConnection early(door_->address());
  EXPECT_EQ(door_->num_connections(), 0);
  LetIn();
  AwaitLetIn(1);
  EXPECT_EQ(door_->num_connections(), 1);
}

TEST_F(DoorTest, GivesThePlaceOfWhoHasLongBeenSilent) {
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

TEST_F(DoorTest, TakesNoPlaceFromWhoHasFew) {
  LetIn();
  const TcpConnection lone = Connect("127.0.0.2");
  std::vector<TcpConnection> crowd;
  for (int i = 0; i < 3 * kMaxConnections; ++i) crowd.push_back(Connect());
  EXPECT_TRUE(IsOpen(lone));
  EXPECT_EQ(door_->num_connections(), kMaxConnections);
}

TEST_F(DoorTest, LearnsThatAConnectionHasEnded) {
  LetIn();
  const TcpConnection connection = Connect();
  shutdown(sockets_.front(), SHUT_RDWR);  // as gRPC does before it closes
  Await("the connection is forgotten", [&] { return door_->num_connections() == 0; });
}

TEST_F(DoorTest, EndsAllConnectionsAndThenNewOnesWait) {
  LetIn();
  const TcpConnection connection = Connect();
  door_->HangUp();
  Await("the connection is ended", [&] { return !IsOpen(connection); });
  const TcpConnection next(door_->address());
  LetIn();
  AwaitLetIn(2);
}

TEST_F(DoorTest, HangsUpOnTheSilentOnceItIsClosed) {
  LetIn();
  const TcpConnection silent = Connect();
  const TcpConnection alive = Connect();
  door_->Close(std::chrono::milliseconds(300), std::chrono::hours(1));
  Await("the silent one is hung up on", [&] {
    alive.Send("here");
    return !silent.IsOpen();
  });
  EXPECT_TRUE(IsOpen(alive));
  EXPECT_THROW(TcpConnection(door_->address()), std::runtime_error);
}

TEST(Door, TellsWhyItCannotListen) {
  const auto first = Door::Open("127.0.0.1:0", 1);
  ASSERT_TRUE(first.ok()) << first.status();
  for (const std::string& listen : {(*first)->address(), std::string("192.0.2.1:0")}) {
    const auto door = Door::Open(listen, 1);
    EXPECT_EQ(door.status().code(), absl::StatusCode::kUnavailable) << listen;
    EXPECT_THAT(std::string(door.status().message()), testing::HasSubstr(listen));
  }
}

TEST(Door, IsReachedByTheMachineItself) {
  for (const auto& [listen, own] : std::vector<std::pair<std::string, std::string>>{
           {"127.0.0.1:0", "127.0.0.1:"}, {"localhost:0", ""}, {"0.0.0.0:0", ""}}) {
    const auto door = Door::Open(listen, 1);
    ASSERT_TRUE(door.ok()) << door.status();
    EXPECT_THAT((*door)->own_address(), testing::StartsWith(own));
    EXPECT_THAT((*door)->address(), testing::StartsWith(listen.substr(0, listen.size() - 1)));
    const std::string port = (*door)->address().substr((*door)->address().rfind(':'));
    const TcpConnection connection("127.0.0.1" + port);
  }
}

}  // namespace
}  // namespace scanloc::server
