// What a stranger can make the real program hold or forget, and whether it is as before afterwards.
#include "support/flood.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "front/listen_sockets.hpp"
#include "metered_scanlocd.hpp"
#include "support/long_tests.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/raw_call.hpp"
#include "support/raw_http2.hpp"
#include "support/small_map.hpp"
#include "support/tcp_connection.hpp"

namespace scanloc::server {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr const char* kLocalize = "/scanloc.v1.Localization/Localize";
constexpr const char* kCheck = "/grpc.health.v1.Health/Check";
constexpr const char* kWatch = "/grpc.health.v1.Health/Watch";
constexpr const char* kPrlimit = "/usr/bin/prlimit";
constexpr const char* kHaproxy = "/usr/sbin/haproxy";

/// After an attack everything must be as before within 5 s; on a machine that does other things
/// beside the short tests, it may take longer.
const std::chrono::seconds kRecovery(test::LongTests() ? 5 : 20);

/// The proxy holds those who ask too often to a rate.
constexpr milliseconds kBetweenTries(50);
/// For which memory has to stay within its bound.
constexpr std::chrono::seconds kSteady(1);

class FloodTest : public MeteredScanlocdTest {
 protected:
  void StartTown(std::vector<std::string> arguments = {},
                 const std::vector<std::string>& front = {}) {
    arguments.insert(arguments.end(), {"--map", "town=" + WriteMap("town", 1)});
    StartMetered(arguments, {}, front);
    ASSERT_FALSE(HasFatalFailure());
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(IsAnswered());
    before_kb_ = ResidentKb();
  }

  [[nodiscard]] bool IsAnswered() const {
    const auto client = client::Client::Connect({.address = address_});
    if (!client.ok()) return false;
    const auto reply = client->LocalizeScan(test::QueryScan(1, 2), {.timeout = kRecovery});
    return reply.ok() && reply->answer.candidates.front().place == 2;
  }

  /// Waits until queries are answered and memory is, and for a while stays, within its bound: what
  /// was on its way when the attack ended still arrives. Tells which of them took too long.
  void ExpectAsBefore() const {
    const auto start = Clock::now();
    const auto latest = start + kSanitizerFactor * kRecovery;
    while (!IsAnswered()) {
      ASSERT_LT(Clock::now(), latest) << "no answer\n" << Log();
      std::this_thread::sleep_for(kBetweenTries);
    }
    const std::chrono::duration<double> until_answer = Clock::now() - start;
    const long bound_kb = 2 * kSanitizerFactor * before_kb_;
    auto good = Clock::now();
    for (auto now = good; now - good < kSteady; now = Clock::now()) {
      std::this_thread::sleep_for(milliseconds(50));
      if (ResidentKb() <= bound_kb) continue;
      ASSERT_LT(now, latest) << ResidentKb() << " kB, before " << before_kb_ << '\n' << Log();
      good = now;
    }
    EXPECT_TRUE(IsAnswered());
    std::cout << "before " << before_kb_ << " kB, most " << scanlocd_->StatusOf("VmHWM")
              << ", after " << ResidentKb() << "; answer after " << until_answer.count()
              << " s, memory after " << std::chrono::duration<double>(good - start).count()
              << " s; made anew " << NumRebuilds("memory") << " + " << NumRebuilds("deaf") << '\n';
  }

  void Attack(const test::Flood& flood) const {
    constexpr int kNumConnections = 4;
    test::Flooders flooders(address_, flood, kNumConnections);
    std::this_thread::sleep_for(test::LongTests() ? std::chrono::seconds(30)
                                                  : std::chrono::seconds(2));
    flooders.Stop();
  }

  long before_kb_ = 0;
};

struct NamedFlood {
  const char* name;
  test::Flood (*make)();
};

class FloodsTest : public FloodTest, public testing::WithParamInterface<NamedFlood> {};

TEST_P(FloodsTest, LeaveNothingBehind) {
  StartTown();
  Attack(GetParam().make());
  ExpectAsBefore();
  ExpectStopsWell();
}

/// The proxy of docker/haproxy.cfg in front of the server: of a flood nothing gets through to it.
class ProxiedFloodsTest : public FloodTest, public testing::WithParamInterface<NamedFlood> {
 protected:
  void StartProxy() {
    const auto listening = ListenAt("127.0.0.1:0").value();
    for (const int socket : listening.sockets) close(socket);
    proxy_.emplace(
        std::vector<std::string>{kHaproxy, "-db", "-f", test::SourceDir() + "/docker/haproxy.cfg"},
        test::ProcessOptions{.stdout_path = dir_.Write("proxy", ""),
                             .merge_stderr = true,
                             .environment = {"LISTEN=" + listening.own_address,
                                             "REPLICA_1=" + address_, "REPLICA_2=" + address_}});
    address_ = listening.own_address;
    Await("the proxy passes queries on", [&] { return IsAnswered(); });
  }

  std::optional<test::Process> proxy_;
};

TEST_P(ProxiedFloodsTest, DoNotReachTheServer) {
  if (!std::filesystem::exists(kHaproxy)) GTEST_SKIP() << "haproxy is not installed";
  StartTown();
  StartProxy();
  const long proxy_before_kb = proxy_->StatusOf("VmRSS");
  Attack(GetParam().make());
  ExpectAsBefore();
  EXPECT_LT(proxy_->StatusOf("VmHWM"), 2 * proxy_before_kb + 32 * 1024);
  for (const char* reason : {"deaf", "memory"}) EXPECT_EQ(NumRebuilds(reason), 0.0) << reason;
}

const auto kFloods = testing::Values(
    NamedFlood{"RapidReset", [] { return test::RapidReset(kLocalize); }},
    NamedFlood{"ResetsOfHealth", [] { return test::ResetAfterMessage(kCheck); }},
    NamedFlood{"UnknownMethods", [] { return test::RapidReset("/no.such/Method"); }},
    NamedFlood{"UnlimitedCalls", [] { return test::CallsWithoutSettings(kLocalize); }},
    NamedFlood{"UnlimitedWatches", [] { return test::CallsWithoutSettings(kWatch); }},
    NamedFlood{"EndlessHeaders", [] { return test::EndlessHeaders(kLocalize); }},
    NamedFlood{"EndlessSettings", [] { return test::EndlessSettings(); }},
    NamedFlood{"EndlessPings", [] { return test::EndlessPings(); }});
const auto kNameOfFlood = [](const auto& info) { return info.param.name; };
INSTANTIATE_TEST_SUITE_P(Floods, FloodsTest, kFloods, kNameOfFlood);
INSTANTIATE_TEST_SUITE_P(Floods, ProxiedFloodsTest, kFloods, kNameOfFlood);

TEST_F(FloodTest, MayGoOnWhileTheServerStops) {
  StartTown({"--drain-seconds", "3"});
  test::Flooders flooders(address_, test::RapidReset(kLocalize), 4);
  std::this_thread::sleep_for(milliseconds(500));
  const auto start = Clock::now();
  ExpectStopsWell();
  EXPECT_LT(Clock::now() - start, kSanitizerFactor * std::chrono::seconds(6));
}

#ifndef SCANLOC_SANITIZED
TEST_F(FloodTest, IsSurvivedWithLittleAddressSpace) {
  StartTown({}, {kPrlimit, "--as=3000000000"});
  Attack(test::CallsWithoutSettings(kLocalize));
  ExpectAsBefore();
  ExpectStopsWell();
}
#endif

/// Calls whose answers the client never allows to be sent.
TEST_F(FloodTest, UnreadAnswersAreDropped) {
  StartTown({"--receive-seconds", "0.5"});
  const std::string request = test::ScanRequest(test::QueryScan(1, 2)).SerializeAsString();
  std::vector<std::unique_ptr<test::RawHttp2>> hostile;
  for (int i = 0; i < (test::LongTests() ? 200 : 20); ++i) {
    hostile.push_back(std::make_unique<test::RawHttp2>(address_, /*window_bytes=*/0));
    for (int call = 0; call < 10; ++call) {
      const std::uint32_t stream = hostile.back()->Call(kLocalize);
      hostile.back()->Send(stream, test::GrpcMessage(request.size(), request));
    }
  }
  for (const auto& client : hostile) {
    for (std::uint32_t stream = 1; stream < 20; stream += 2) client->AwaitEnd(stream);
  }
  ExpectAsBefore();
}

TEST_F(FloodTest, UnreadAnswersDoNotHoldTheStop) {
  StartTown({"--drain-seconds", "3600"});
  const std::string request = test::ScanRequest(test::QueryScan(1, 2)).SerializeAsString();
  test::RawHttp2 hostile(address_, /*window_bytes=*/0);
  const std::uint32_t call = hostile.Call(kLocalize);
  hostile.Send(call, test::GrpcMessage(request.size(), request));
  hostile.AwaitHeaders(call);
  const std::uint32_t watch = hostile.Call(kWatch);
  hostile.Send(watch, test::GrpcMessage(0, ""));
  hostile.AwaitHeaders(watch);
  ExpectStopsWell();  // though nobody answers its goodbye, either
}

TEST_F(FloodTest, MoreConnectionsThanDescriptors) {
  rlimit own = {};
  getrlimit(RLIMIT_NOFILE, &own);
  if (own.rlim_cur < 2048) GTEST_SKIP() << "the test itself needs more descriptors";
  StartTown({}, {kPrlimit, "--nofile=1024:1024"});
  {
    std::vector<test::TcpConnection> crowd;
    for (int i = 0; i < 1084; ++i) crowd.emplace_back(address_);
    EXPECT_TRUE(IsAnswered());
    EXPECT_LT(Metric("process_open_fds"), 1024);
  }
  ExpectAsBefore();
  EXPECT_EQ(NumRebuilds("deaf"), 0.0);
}

TEST_F(FloodTest, DescriptorsThatAreTakenAwayAreWaitedFor) {
  StartTown();
  const auto set_limit = [&](const std::string& limit) {
    const std::string process = std::to_string(scanlocd_->pid());
    ASSERT_EQ(test::RunProcess({kPrlimit, "--pid", process, "--nofile=" + limit}).status, 0);
  };
  set_limit("20:4096");
  {
    std::vector<test::TcpConnection> crowd;
    for (int i = 0; i < 100; ++i) crowd.emplace_back(address_);
    std::this_thread::sleep_for(milliseconds(500));
  }
  set_limit("4096:4096");
  ExpectAsBefore();
}

}  // namespace
}  // namespace scanloc::server
