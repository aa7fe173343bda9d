#include "lifecycle.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

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
  auto server = Server::Start(options, [&](const std::string&) -> absl::StatusOr<Map> {
    never.Wait();
    std::abort();
  });
  std::exit(RunUntilStopped(**server, std::chrono::duration<double>(options.drain_s)));
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

}  // namespace
}  // namespace scanloc::server
