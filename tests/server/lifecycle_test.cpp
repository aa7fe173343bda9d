#include "lifecycle.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <system_error>

#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

/// Runs a server whose map never finishes loading, with signals already pending.
[[noreturn]] void RunLoadingForEver(std::initializer_list<int> signals) {
  BlockStopSignals();
  for (const int signal : signals) kill(getpid(), signal);
  test::Gate never;
  ServerOptions options = test::OptionsFor({{"town", test::SmallMap(1, 2)}});
  options.drain_s = 0.1;
  auto server = Server::Start(options, [&](const std::string&, const Map*) -> absl::StatusOr<Map> {
    never.Wait();
    std::abort();
  });
  std::exit(RunUntilStopped(**server, std::chrono::duration<double>(options.drain_s)));
}

/// Runs a server that the first signal makes start a second thread, which there is none for.
[[noreturn]] void RunWithoutSecondThread(int signal) {
  BlockStopSignals();
  const test::Maps maps = {{"town", test::SmallMap(1, 2)}};
  const ServerOptions options = test::OptionsFor(maps);
  auto server = Server::Start(options, test::LoaderOf(maps));
  int num_started = 0;
  const auto start_thread = [&](std::function<void()> work) {
    if (++num_started != 2) return std::thread(std::move(work));
    if (signal != SIGTERM) kill(getpid(), SIGTERM);  // what it is to live for
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
  };
  kill(getpid(), signal);
  std::exit(
      RunUntilStopped(**server, std::chrono::duration<double>(options.drain_s), start_thread));
}

class LifecycleDeathTest : public testing::Test {
 protected:
  // The other style forks a process that already has threads.
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(LifecycleDeathTest, EndsThoughAMapStillLoads) {
  EXPECT_EXIT(RunLoadingForEver({SIGTERM}), testing::ExitedWithCode(0), "");
}

TEST_F(LifecycleDeathTest, EndsAtOnceAtASecondSignal) {
  EXPECT_EXIT(RunLoadingForEver({SIGTERM, SIGINT}), testing::ExitedWithCode(128 + SIGTERM), "");
}

TEST_F(LifecycleDeathTest, LivesOnWithoutAThreadToReloadWith) {
  EXPECT_EXIT(RunWithoutSecondThread(SIGHUP), testing::ExitedWithCode(0), "");
}

TEST_F(LifecycleDeathTest, StopsWellWithoutAThreadForIt) {
  EXPECT_EXIT(RunWithoutSecondThread(SIGTERM), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace scanloc::server
