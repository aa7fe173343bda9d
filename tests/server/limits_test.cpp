// What the real program spends on clients that mean it no good, and whether others are served
// meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <csignal>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "scanlocd_fixture.hpp"
#include "support/raw_call.hpp"
#include "support/raw_http2.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

constexpr const char* kLocalize = "/scanloc.v1.Localization/Localize";
constexpr const char* kStream = "/scanloc.v1.Localization/LocalizeStream";
constexpr const char* kGood = "a-token-of-the-fleet-0001";
constexpr const char* kHostile = "a-token-of-the-fleet-0002";
constexpr const char* kAdmin = "a-token-of-the-fleet-0003";
constexpr const char* kReload = "/scanloc.v1.Admin/ReloadMap";
constexpr const char* kReflection =
    "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
constexpr const char* kWatch = "/grpc.health.v1.Health/Watch";

/// What a sanitizer keeps beside what is used.
#ifdef SCANLOC_SANITIZED
constexpr long kMemoryFactor = 6;
#else
constexpr long kMemoryFactor = 1;
#endif

const std::string kListServices = test::GrpcMessage(2, std::string("\x3a\x00", 2));

class LimitsTest : public ScanlocdTest {
 protected:
  void StartWith(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--map", "town=" + WriteMap("town", 1)});
    Start(arguments);
    ASSERT_FALSE(HasFatalFailure());
    ExpectAnswer();
  }

  void StartWithTokens(std::vector<std::string> arguments) {
    token_ = kGood;
    arguments.insert(arguments.end(),
                     {"--token-file",
                      dir_.Write("tokens", std::string("fleet query ") + kGood + "\nother query " +
                                               kHostile + "\nboss admin " + kAdmin + "\n")});
    StartWith(arguments);
  }

  /// A client of good will is answered; it asks again where the server, short of memory, shuts its
  /// connection.
  void ExpectAnswer() const {
    const auto client = client::Client::Connect({.address = address_,
                                                 .token = token_,
                                                 .connect_timeout = std::chrono::milliseconds(0),
                                                 .retry = {.max_attempts = 50}});
    ASSERT_TRUE(client.ok()) << client.status();
    const auto reply =
        client->LocalizeScan(test::QueryScan(1, 2), {.timeout = test::Process::kPatience});
    EXPECT_TRUE(reply.ok()) << reply.status();
  }

  [[nodiscard]] long PeakMemoryKb() const { return scanlocd_->StatusOf("VmHWM"); }
  [[nodiscard]] long NumThreads() const { return scanlocd_->StatusOf("Threads"); }

  std::string token_;  // of ExpectAnswer
};

TEST_F(LimitsTest, HoldsHalfSentMessagesWithinItsMemory) {
  StartWithTokens({"--max-memory-bytes", "67108864"});
  const long before_kb = PeakMemoryKb();
  const std::string half = test::GrpcMessage(7'000'000, std::string(6'000'000, 'x'));
  for (const char* path : {kLocalize, kStream}) {
    std::vector<std::thread> senders;
    for (int i = 0; i < 4; ++i) {
      senders.emplace_back([&] {
        test::RawHttp2 hostile(address_);
        for (int call = 0; call < 20; ++call) hostile.Send(hostile.Call(path, kHostile), half);
        ExpectAnswer();
      });
    }
    for (std::thread& sender : senders) sender.join();
  }
  // Of the 960 MB sent; what the allocator keeps beside the 64 MiB is its own.
  EXPECT_LT(PeakMemoryKb() - before_kb, 160 * 1024 * kMemoryFactor);
}

TEST_F(LimitsTest, EndsACallWhoseRequestDoesNotArrive) {
  StartWith({"--receive-seconds", "0.05"});
  for (const char* path :
       {kLocalize, "/scanloc.v1.Localization/ListMaps", "/grpc.health.v1.Health/Check", kWatch}) {
    test::RawHttp2 slow(address_);
    const std::uint32_t call = slow.Call(path);
    slow.Send(call, test::GrpcMessage(1000, "half"));
    slow.AwaitEnd(call);
  }
  ExpectAnswer();
}

// Strangers' health checks take no place of a robot that is slow to send, though all come from one
// address.
TEST_F(LimitsTest, ReceivesARobotBesideHalfSentHealthChecks) {
  StartWith({"--max-memory-bytes", "67108864"});  // eight requests of the largest size
  const std::string scan = test::ScanRequest(test::QueryScan(1, 2)).SerializeAsString();
  const std::string request = test::GrpcMessage(scan.size(), scan);
  const std::string half = test::GrpcMessage(1000, "half");
  constexpr const char* kCheck = "/grpc.health.v1.Health/Check";
  test::RawHttp2 strangers(address_);
  for (int i = 0; i < 80; ++i) strangers.Send(strangers.Call(kCheck), half);
  test::RawHttp2 robot(address_);
  const std::uint32_t call = robot.Call(kLocalize);
  robot.Send(call, request.substr(0, request.size() / 2));
  // One too many is told so once it counts, and then the robot, which came before, counts, too.
  const std::uint32_t last = strangers.Call(kCheck);
  strangers.Send(last, half);
  strangers.AwaitEnd(last);
  robot.Send(call, request.substr(request.size() / 2));
  robot.AwaitEnd(call);
  EXPECT_TRUE(robot.HasMessage(call));
}

// Behind a proxy robots share a connection.
TEST_F(LimitsTest, KeepsTheConnectionOfACallWithLongHeaders) {
  StartWith({});
  test::RawHttp2 shared(address_);
  const std::uint32_t other = shared.Call(kReflection);
  shared.Send(other, kListServices);
  shared.AwaitHeaders(other);
  const std::uint32_t long_call = shared.Call(kReload, std::string(9000, 'x'));
  shared.AwaitEnd(long_call);
  const std::uint32_t next = shared.Call(kReflection);
  shared.Send(next, kListServices);
  shared.AwaitHeaders(next);
  EXPECT_FALSE(shared.is_closed());
}

TEST_F(LimitsTest, StopsDespiteWhoNeverEnds) {
  StartWith({"--drain-seconds", "3600"});
  test::RawHttp2 hostile(address_);
  for (const char* path : {kLocalize, kWatch, kReflection}) {
    hostile.Send(hostile.Call(path), test::GrpcMessage(1000, "half"));
  }
  const std::uint32_t asked = hostile.Call(kReflection);
  hostile.Send(asked, kListServices);
  hostile.AwaitHeaders(asked);
  scanlocd_->Signal(SIGTERM);
  hostile.AwaitClose();
  EXPECT_EQ(scanlocd_->Wait(), 0) << scanlocd_->stderr_text();
}

TEST_F(LimitsTest, ReceivesAdministrationFromAdministratorsOnly) {
  StartWithTokens({"--admin", "--drain-seconds", "3600", "--receive-seconds", "3600"});
  const std::string half = test::GrpcMessage(1000, "half");
  test::RawHttp2 hostile(address_);
  const std::uint32_t refused = hostile.Call(kReload, kHostile);
  hostile.Send(refused, half);
  hostile.AwaitEnd(refused);
  hostile.Send(hostile.Call(kReload, kAdmin), half);
  scanlocd_->Signal(SIGTERM);
  hostile.AwaitClose();
  EXPECT_EQ(scanlocd_->Wait(), 0) << scanlocd_->stderr_text();
}

/// So many zeros in the format of gzip.
std::string GzipOfZeros(std::size_t num_megabytes) {
  constexpr int kGzip = 15 + 16;  // largest window; gzip instead of zlib
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 1, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string zeros(1'000'000, '\0');
  std::string packed(10'000 * num_megabytes + 1000, '\0');
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  for (std::size_t i = 1; i <= num_megabytes; ++i) {
    stream.next_in = reinterpret_cast<Bytef*>(zeros.data());
    stream.avail_in = static_cast<uInt>(zeros.size());
    deflate(&stream, i == num_megabytes ? Z_FINISH : Z_NO_FLUSH);
  }
  packed.resize(stream.total_out);
  EXPECT_EQ(deflateEnd(&stream), Z_OK);
  return packed;
}

TEST_F(LimitsTest, DoesNotUnpackWhatIsCompressed) {
  StartWith({});
  const long before_kb = PeakMemoryKb();
  const std::string bomb = GzipOfZeros(300);
  std::string message = test::GrpcMessage(bomb.size(), bomb);
  message[0] = 1;  // compressed
  for (const char* path : {kLocalize, kStream, kWatch, kReflection}) {
    test::RawHttp2 hostile(address_);
    const std::uint32_t call = hostile.Call(path, "", "gzip");
    hostile.Send(call, message);
    hostile.AwaitEnd(call);
  }
  EXPECT_LT(PeakMemoryKb() - before_kb, 64 * 1024);
  ExpectAnswer();
}

TEST_F(LimitsTest, SaysThatItDoesNotUnpack) {
  StartWith({});
  const std::string zeros(100'000, '\0');
  const grpc::Slice slice(zeros);
  const grpc::ByteBuffer request(&slice, 1);
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ByteBuffer response;
    grpc::ClientContext context;
    test::SetPatience(context);
    context.set_compression_algorithm(algorithm);
    std::promise<grpc::Status> ended;
    grpc::GenericStub(test::ChannelTo(address_))
        .UnaryCall(&context, kLocalize, {}, &request, &response,
                   [&](const grpc::Status& status) { ended.set_value(status); });
    EXPECT_EQ(ended.get_future().get().error_code(), grpc::StatusCode::UNIMPLEMENTED);
  }
}

TEST_F(LimitsTest, SpendsNoThreadOnAStream) {
  StartWith({});
  const long before = NumThreads();
  std::vector<std::unique_ptr<test::RawHttp2>> clients;
  for (int i = 0; i < 4; ++i) {
    clients.push_back(std::make_unique<test::RawHttp2>(address_));
    for (int call = 0; call < 60; ++call) {
      clients.back()->Call(kWatch);
      clients.back()->Call(kStream);
      const std::uint32_t asked = clients.back()->Call(kReflection);
      clients.back()->Send(asked, kListServices);
      clients.back()->AwaitHeaders(asked);
    }
  }
  ExpectAnswer();
  EXPECT_LT(NumThreads() - before, 32);
}

TEST_F(LimitsTest, SendsAwayWhoPingsTooOften) {
  StartWith({});
  test::RawHttp2 hostile(address_);
  for (int i = 0; i < 100; ++i) hostile.Ping();
  EXPECT_THAT(hostile.AwaitGoAway(), HasSubstr("too_many_pings"));
  ExpectAnswer();
}

TEST_F(LimitsTest, AnswersOthersWhileAnswersAreNotRead) {
  StartWith({});
  // Nobody may send this client a single byte of an answer.
  test::RawHttp2 hostile(address_, /*window_bytes=*/0);
  const std::string request = test::ScanRequest(test::QueryScan(1, 2)).SerializeAsString();
  for (int i = 0; i < 50; ++i) {
    const std::uint32_t call = hostile.Call(kLocalize);
    hostile.Send(call, test::GrpcMessage(request.size(), request));
    hostile.AwaitHeaders(call);
  }
  ExpectAnswer();
}

TEST_F(LimitsTest, AnswersOthersDespiteIdleConnections) {
  StartWith({});
  std::vector<test::TcpConnection> idle;
  for (int i = 0; i < 900; ++i) {  // as many as a usual limit of open files lets a test have
    idle.emplace_back(address_);
    if (i % 2 == 0) idle.back().Send(test::Http2Opening() + test::Http2CallHeaders(1, kLocalize));
  }
  ExpectAnswer();
}

TEST_F(LimitsTest, DoesNotLetStrangersFillTheLog) {
  StartWithTokens({});
  const auto channel = test::ChannelTo(address_);
  int num_told_to_wait = 0;
  for (int i = 0; i < 60; ++i) {
    const grpc::StatusCode code = test::CallWithBytes(channel, kLocalize, "").error_code();
    if (code == grpc::StatusCode::RESOURCE_EXHAUSTED) {
      ++num_told_to_wait;
    } else {
      EXPECT_EQ(code, grpc::StatusCode::UNAUTHENTICATED);
    }
  }
  EXPECT_GT(num_told_to_wait, 0);
  ExpectAnswer();
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  std::size_t num_lines = 0;
  const std::string& log = scanlocd_->stderr_text();
  for (std::size_t at = log.find("code=UNAUTH"); at != std::string::npos;
       at = log.find("code=UNAUTH", at + 1)) {
    ++num_lines;
  }
  EXPECT_EQ(num_lines, 60U - static_cast<std::size_t>(num_told_to_wait)) << log;
}

}  // namespace
}  // namespace scanloc::server
