// What strangers may send to the HTTP server, and leave unsent.
#include <algorithm>
#include <atomic>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "http_fixture.hpp"

namespace scanloc::web {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

class HostileHttpTest : public HttpTest {
 protected:
  /// Whatever was sent, the service goes on.
  void TearDown() override { EXPECT_EQ(Get("/v1/maps").status, 200); }
};

TEST_F(HostileHttpTest, RefusesWhatIsNoRequest) {
  StartWeb();
  EXPECT_EQ(Ask("nonsense\r\n\r\n").status, 400);
  EXPECT_EQ(Ask(std::string("\0\0\0\0\r\n\r\n", 8)).status, 400);
  EXPECT_EQ(Ask("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n").status, 400);
  EXPECT_EQ(Get("/v1/%zz").status, 400);
  EXPECT_EQ(Get("/v1/%").status, 400);
  EXPECT_EQ(Get("/v1/%00").status, 400);
  EXPECT_EQ(Get("http://elsewhere/").status, 400);
  EXPECT_EQ(Get("/../../etc/passwd").status, 404);
  EXPECT_EQ(Get("/%2e%2e/%2e%2e/etc/passwd").status, 404);
  EXPECT_EQ(Ask("POST /v1/localize HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n"
                "Content-Length: 6\r\nConnection: close\r\n\r\n01234")
                .status,
            400);
}

TEST_F(HostileHttpTest, BoundsHeadersBodiesAndParameters) {
  HttpOptions options;
  options.max_body_bytes = 1000;
  StartWeb(options);
  EXPECT_EQ(Get("/v1/maps", "X-Long: " + std::string(100'000, 'x') + "\r\n").status, 431);
  std::string many;
  for (int i = 0; i < 5000; ++i) absl::StrAppend(&many, "A", i, ": b\r\n");
  EXPECT_EQ(Get("/v1/maps", many).status, 431);
  std::string parameters = "/v1/maps?";
  for (int i = 0; i < 100; ++i) absl::StrAppend(&parameters, "a=b&");
  EXPECT_EQ(Get(parameters).status, 400);
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize", std::string(1001, 'x'))).status, 413);
  EXPECT_EQ(Ask("POST /v1/localize HTTP/1.1\r\nHost: localhost\r\nContent-Length: "
                "99999999999999\r\nConnection: close\r\n\r\n")
                .status,
            413);
  EXPECT_EQ(Ask("POST /v1/localize HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n"
                "Connection: close\r\n\r\n5\r\n01234\r\n0\r\n\r\n")
                .status,
            411);
  EXPECT_EQ(Ask(RequestText("POST", "/v1/maps", "a body")).status, 413);
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize", "a body", "Content-Encoding: gzip\r\n")).status,
            415);
}

TEST_F(HostileHttpTest, BoundsBodiesThatAreOnTheirWay) {
  HttpOptions options;
  options.max_body_bytes = 1000;
  options.max_bytes_at_hand = 1500;
  StartWeb(options);
  const std::string half = RequestText("POST", "/v1/localize", std::string(1000, 'x'));
  auto slow = std::make_unique<test::TcpConnection>(address_);
  slow->Send(half.substr(0, half.size() - 1));
  while (true) {  // until the server has seen the header of the slow one
    const Said said = Ask(half);
    if (said.status == 503) break;
    ASSERT_EQ(said.status, 400) << said.body;
  }
  slow.reset();
  while (Ask(half).status == 503) std::this_thread::yield();
}

TEST_F(HostileHttpTest, OneAddressTakesNotAllThatThereIs) {
  HttpOptions options;
  options.listen = "0.0.0.0:0";
  options.max_body_bytes = 1000;
  options.max_bytes_at_hand = 4000;
  options.max_event_streams = 2;
  StartWeb(options);
  constexpr const char* kGreedy = "127.0.0.7";
  const auto asks = [&](const std::string& request) {
    const test::TcpConnection connection(address_, kGreedy);
    connection.Send(request);
    return Parse(connection.ReadAll()).status;
  };
  const std::string body = RequestText("POST", "/v1/localize", std::string(1000, 'x'));
  std::vector<test::TcpConnection> slow;
  for (int i = 0; i < 2; ++i) {
    slow.emplace_back(address_, kGreedy).Send(body.substr(0, body.size() - 1));
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (asks(body) != 503) {  // until both headers are seen
    ASSERT_LT(std::chrono::steady_clock::now(), end);
  }
  EXPECT_EQ(Ask(body).status, 400);  // no scan, but taken

  const std::string watch = "GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const test::TcpConnection watching(address_, kGreedy);
  watching.Send(watch);
  EXPECT_THAT(watching.Read(12), HasSubstr("200"));
  EXPECT_EQ(asks(watch), 503);
  const test::TcpConnection other(address_);
  other.Send(watch);
  EXPECT_THAT(other.Read(12), HasSubstr("200"));
}

TEST_F(HostileHttpTest, HangsUpOnThoseWhoAreSilentOrSlow) {
  HttpOptions options;
  options.idle = milliseconds(1000);
  options.receive = milliseconds(1000);
  StartWeb(options);
  const test::TcpConnection silent(address_);
  const test::TcpConnection half_header(address_);
  half_header.Send("GET /v1/maps HTT");
  const test::TcpConnection half_body(address_);
  half_body.Send(
      "POST /v1/localize HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n0123");
  EXPECT_EQ(silent.ReadAll(), "");
  EXPECT_EQ(half_header.ReadAll(), "");
  EXPECT_EQ(half_body.ReadAll(), "");
}

TEST_F(HostileHttpTest, ADropNowAndThenDoesNotHoldAConnection) {
  HttpOptions options;
  options.idle = milliseconds(1000);
  StartWeb(options);
  const test::TcpConnection dripping(address_);
  const std::string request = "GET /v1/maps HTTP/1.1\r\nX-Slow: ";
  dripping.Send(request);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (dripping.IsOpen()) {
    ASSERT_LT(std::chrono::steady_clock::now(), end);
    dripping.Send("x");
    std::this_thread::sleep_for(milliseconds(20));  // the client's pace, not a wait of the test
  }
}

TEST_F(HostileHttpTest, BoundsConnectionsAndEventStreams) {
  HttpOptions options;
  options.max_connections = 8;
  options.max_event_streams = 1;
  StartWeb(options);
  const std::string watch = "GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
  {
    const test::TcpConnection first(address_);
    first.Send(watch);
    EXPECT_THAT(first.Read(12), HasSubstr("200"));
    const test::TcpConnection second(address_);
    second.Send(watch);
    EXPECT_THAT(second.Read(12), HasSubstr("503"));
    std::vector<test::TcpConnection> others;
    for (int i = 0; i < 6; ++i) others.emplace_back(address_);
    const test::TcpConnection one_too_many(address_);
    EXPECT_EQ(one_too_many.ReadAll(), "");
  }
  while (Get("/v1/maps").status != 200) std::this_thread::yield();
}

TEST_F(HostileHttpTest, TellsClientsApartByAddressWhateverItListensOn) {
  for (const char* listen : {"0.0.0.0:0", "[::]:0"}) {
    HttpOptions options;
    options.listen = listen;
    options.max_of_address = 2;
    StartWeb(options);
    const test::TcpConnection first(address_, "127.0.0.7");
    const test::TcpConnection second(address_, "127.0.0.7");
    const test::TcpConnection one_too_many(address_, "127.0.0.7");
    EXPECT_EQ(one_too_many.ReadAll(), "");
    EXPECT_EQ(Get("/v1/maps").status, 200) << listen;
  }
}

TEST_F(HostileHttpTest, LetsGoOfThoseWhoDoNotRead) {
  HttpOptions options;
  options.send = milliseconds(300);
  options.max_event_streams = 1;
  options.event_interval = milliseconds(1);
  StartWeb(options);
  // Far more than the buffers of a connection hold.
  auto flood = HttpServer::Start(
      [&] {
        HttpOptions own = options;
        own.listen = "127.0.0.1:0";
        own.max_connections = 1;
        return own;
      }(),
      [](const Request&) { return false; },
      [](const Request& request) {
        if (request.path == "/small") return Response{.body = "x"};
        return Response{.events = [] { return std::string(1 << 20, 'x'); }};
      });
  ASSERT_TRUE(flood.ok()) << flood.status();
  const std::string address = (*flood)->url().substr(7);
  const test::TcpConnection deaf(address);
  deaf.Send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  ASSERT_TRUE(deaf.AwaitSomething());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (Parse(test::HttpGet(address, "/small")).status == 0) {  // its connection is the only one
    ASSERT_LT(std::chrono::steady_clock::now(), end);
    std::this_thread::sleep_for(milliseconds(20));
  }
}

TEST_F(HostileHttpTest, WatchersKeepNoRequestWaiting) {
  StartWeb();
  HttpOptions options;
  options.listen = "127.0.0.1:0";
  std::atomic<int> num_hanging = 0;
  std::promise<void> let_go;
  const std::shared_future<void> is_let_go = let_go.get_future().share();
  auto web = HttpServer::Start(
      options, [](const Request&) { return false; },
      [&](const Request& request) {
        if (request.path == "/quick") return Response{.body = "x"};
        return Response{.events = [&num_hanging, is_let_go, is_first = true]() mutable {
          if (std::exchange(is_first, false)) ++num_hanging;
          is_let_go.wait();  // as for a server that does not answer
          return std::string();
        }};
      });
  ASSERT_TRUE(web.ok()) << web.status();
  const std::string address = (*web)->url().substr(7);
  std::vector<test::TcpConnection> watching;
  for (int i = 0; i < options.num_workers; ++i) {
    watching.emplace_back(address).Send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(watching.back().AwaitSomething());
  }
  while (num_hanging < options.num_watchers) std::this_thread::yield();
  const test::TcpConnection quick(address);
  quick.Send(RequestText("GET", "/quick"));
  EXPECT_EQ(Parse(quick.ReadAll()).status, 200);
  let_go.set_value();
}

TEST_F(HostileHttpTest, BeginsNothingMoreOnceItEnds) {
  StartWeb();
  HttpOptions options;
  options.listen = "127.0.0.1:0";
  options.num_workers = 1;
  options.max_waiting = 4;
  std::atomic<int> num_begun = 0;
  std::promise<void> let_go;
  auto web = HttpServer::Start(
      options, [](const Request&) { return false; },
      [&](const Request& request) {
        if (request.path == "/watch") return Response{.events = [] { return std::string(" "); }};
        ++num_begun;
        let_go.get_future().wait();  // of the first; as for a server that does not answer
        return Response{};
      });
  ASSERT_TRUE(web.ok()) << web.status();
  const std::string address = (*web)->url().substr(7);
  const test::TcpConnection watching(address);
  watching.Send(RequestText("GET", "/watch"));
  ASSERT_TRUE(watching.AwaitSomething());
  std::vector<test::TcpConnection> asking;
  for (int i = 0; i <= options.max_waiting; ++i) {
    asking.emplace_back(address).Send(RequestText("GET", "/"));
  }
  // One is refused as soon as all others wait.
  while (std::ranges::all_of(asking, &test::TcpConnection::IsOpen)) std::this_thread::yield();
  while (num_begun == 0) std::this_thread::yield();
  std::thread ending([&] { web->reset(); });
  static_cast<void>(watching.ReadAll());  // it has begun to end
  let_go.set_value();
  ending.join();
  EXPECT_EQ(num_begun, 1);
}

TEST_F(HostileHttpTest, ServesItsOwnNamesOnly) {
  HttpOptions options;
  options.hosts = {"scanloc.fleet"};
  StartWeb(options);
  const auto status_for = [&](const std::string& host) {
    return Ask("GET /v1/maps HTTP/1.1\r\nConnection: close\r\nHost: " + host + "\r\n\r\n").status;
  };
  for (const char* own :
       {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]:80", "scanloc.fleet"}) {
    EXPECT_EQ(status_for(own), 200) << own;
  }
  for (const char* other : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example", ""}) {
    EXPECT_EQ(status_for(other), 421) << other;
  }
}

TEST_F(HostileHttpTest, AnswersRequestAfterRequestAndHeads) {
  StartWeb();
  const test::TcpConnection connection(address_);
  const std::string one = "GET /v1/nothing HTTP/1.1\r\nHost: localhost\r\n\r\n";
  connection.Send(one + one + RequestText("HEAD", "/v1/maps"));
  const std::string all = connection.ReadAll();
  EXPECT_EQ(Parse(all).status, 404);
  const std::size_t last = all.rfind("HTTP/1.1 200");
  ASSERT_NE(last, std::string::npos) << all;
  EXPECT_EQ(Parse(all.substr(last)).body, "");
  EXPECT_THAT(all.substr(last), HasSubstr("X-Content-Type-Options: nosniff"));
}

TEST_F(HostileHttpTest, ContinuesWhenAskedTo) {
  StartWeb();
  const test::TcpConnection connection(address_);
  const std::string scan = KittiBytes(test::QueryScan(1, 4));
  connection.Send(absl::StrCat(
      "POST /v1/localize HTTP/1.1\r\nHost: localhost\r\n",
      "Connection: close\r\nExpect: 100-continue\r\nContent-Length: ", scan.size(), "\r\n\r\n"));
  EXPECT_THAT(connection.Read(25), HasSubstr("100 Continue"));
  connection.Send(scan);
  EXPECT_EQ(Parse(connection.ReadAll()).status, 200);
}

TEST_F(HostileHttpTest, SurvivesClientsThatGoAtAnyPoint) {
  StartWeb();
  const std::string scan = KittiBytes(test::QueryScan(1, 4));
  const std::string request = RequestText("POST", "/v1/localize", scan);
  for (std::size_t cut = 1; cut < request.size(); cut += request.size() / 40 + 1) {
    const test::TcpConnection connection(address_);
    if (cut % 2 == 0) connection.ResetAtEnd();
    connection.Send(request.substr(0, cut));
  }
}

}  // namespace
}  // namespace scanloc::web
