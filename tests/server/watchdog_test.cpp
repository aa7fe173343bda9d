#include "front/watchdog.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "front/listen_sockets.hpp"
#include "front/memory_bound.hpp"
#include "front/self_check.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

constexpr std::int64_t kMuch = std::numeric_limits<std::int64_t>::max() / 64;

/// A port at which nobody answers, though connections can be made to it.
class DeafPort {
 public:
  [[nodiscard]] const std::string& address() const { return listening_.own_address; }
  ~DeafPort() {
    for (const int socket : listening_.sockets) close(socket);
  }

 private:
  const ListenSockets listening_ = ListenAt("127.0.0.1:0").value();
};

/// What a watchdog does for a front at the address, until it has done either.
std::string FirstDeed(const std::string& address, MemoryBound& memory) {
  std::promise<std::string> done;
  std::atomic<bool> is_done = false;
  const auto tell = [&](const std::string& deed) {
    if (!is_done.exchange(true)) done.set_value(deed);
  };
  const Watchdog watchdog({.ask = [&] { return std::make_unique<SelfCheck>(address, nullptr); },
                           .work_bytes = [] { return 0; },
                           .at_hand_bytes = [] { return 0; },
                           .make_anew = tell,
                           .asked =
                               [&](bool is_answered) {
                                 if (is_answered) tell("well");
                               }},
                          memory);
  return done.get_future().get();
}

TEST(Watchdog, IsContentWithAServerThatAnswers) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, 2)}});
  MemoryBound memory(kMuch);
  EXPECT_EQ(FirstDeed(server->address(), memory), "well");
}

TEST(Watchdog, HasADeafFrontMadeAnew) {
  const DeafPort port;
  MemoryBound memory(kMuch);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(FirstDeed(port.address(), memory), "deaf");
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
}

TEST(Watchdog, HasATooLargeFrontMadeAnew) {
  const DeafPort port;
  MemoryBound memory(std::int64_t{1} << 20);
  const std::vector<char> much(std::size_t{64} << 20, 'x');
  EXPECT_EQ(FirstDeed(port.address(), memory), "memory");
  EXPECT_EQ(much.back(), 'x');
}

TEST(MemoryBound, AllowsForAMapThatLoads) {
  constexpr std::int64_t kFileBytes = std::int64_t{8} << 20;
  MemoryBound memory(std::int64_t{1} << 20);
  std::vector<char> map;
  {
    const MemoryBound::Loading loading(memory, kFileBytes);
    map.assign(std::size_t{96} << 20, 'x');
    EXPECT_FALSE(memory.Look(0, [] { return 0; }).is_over);
  }
  EXPECT_FALSE(memory.Look(0, [] { return 0; }).is_over)
      << "what the map takes is not the clients'";
  const std::vector<char> much(std::size_t{64} << 20, 'x');
  EXPECT_TRUE(memory.Look(0, [] { return 0; }).is_over);
  memory.Accept();
  EXPECT_FALSE(memory.Look(0, [] { return 0; }).is_over);
  EXPECT_EQ(map.back(), much.back());
}

TEST(MemoryBound, AllowsForRequestsAtHand) {
  MemoryBound memory(std::int64_t{1} << 40);
  const std::vector<char> much(std::size_t{256} << 20, 'x');
  EXPECT_TRUE(memory.Look(0, [] { return 0; }).is_odd);
  const auto explained = memory.Look(0, [] { return std::int64_t{256} << 20; });
  EXPECT_FALSE(explained.is_odd);
  EXPECT_FALSE(explained.has_slack);
  EXPECT_FALSE(memory.Look(0, [] { return 0; }).is_over);
  EXPECT_EQ(much.back(), 'x');
}

TEST(MemoryBound, AllowsForTheWorkersTables) {
  constexpr std::int64_t kTableBytes = std::int64_t{256} << 20;
  MemoryBound memory(std::int64_t{64} << 20);
  const std::vector<char> tables(kTableBytes, 'x');
  EXPECT_TRUE(memory.Look(0, [] { return 0; }).is_over);
  EXPECT_FALSE(memory.Look(kTableBytes, [] { return 0; }).is_over);
  EXPECT_FALSE(memory.Look(kTableBytes, [] { return 0; }).is_odd);
  EXPECT_EQ(tables.back(), 'x');
}

TEST(MemoryBound, AllowsForWhatIsKeptOfMaps) {
  constexpr std::int64_t kKeptBytes = std::int64_t{256} << 20;
  constexpr int kNumLooks = 30;  // ten a second: longer than the watchdog would put up with it
  std::atomic<std::int64_t> kept_bytes = 0;
  std::atomic<int> num_looks = 0;
  std::promise<void> is_seen;
  const test::Maps maps = {{"town", test::SmallMap(1, 2)}};
  const auto server = Server::Start(test::OptionsFor(maps), test::LoaderOf(maps), [&] {
    if (kept_bytes > 0 && ++num_looks == kNumLooks) is_seen.set_value();
    return kept_bytes.load();
  });
  ASSERT_TRUE(server.ok() && (*server)->LoadMaps().ok());
  const auto num_made_anew_is = [&](const char* number) {
    return testing::HasSubstr(
        absl::StrCat("scanloc_front_rebuilds_total{reason=\"memory\"} ", number, "\n"));
  };
  kept_bytes = kKeptBytes;
  const std::vector<char> kept(kKeptBytes, 'x');
  is_seen.get_future().wait();
  EXPECT_THAT((*server)->MetricsText(), num_made_anew_is("0"));
  kept_bytes = 0;
  while (!testing::Matches(num_made_anew_is("1"))((*server)->MetricsText())) {
    std::this_thread::yield();
  }
  EXPECT_EQ(kept.back(), 'x');
}

}  // namespace
}  // namespace scanloc::server
