// A real server that is killed while it loads a map leaves the file as it is.
#include <random>

#include "metered_scanlocd.hpp"
#include "support/long_tests.hpp"

namespace scanloc::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kBegins[] = "loading map town";
constexpr char kUnchanged[] = "map town is unchanged";
constexpr char kInService[] = "map town in service";

class KilledReloadTest : public ScanlocdTest {
 protected:
  /// Starts the program with its log on stdout, and waits until it is ready.
  void StartLogged() {
    scanlocd_.emplace(Command({"--map", "town=" + path_, "--listen", "127.0.0.1:0", "--log-level",
                               "debug", "--log-requests", "none"}),
                      test::ProcessOptions{.merge_stderr = true});
    const std::string ready = scanlocd_->ReadLineWith("scanlocd ready on ");
    ASSERT_NE(ready, "");
    address_ = ready.substr(std::string("scanlocd ready on ").size());
  }

  void ExpectServes(std::uint64_t seed) const {
    const auto reply = Connect().LocalizeScan(test::QueryScan(seed, 2));
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.candidates.front().place, 2);
  }

  /// How long a reload takes on this machine as it is now.
  [[nodiscard]] Clock::duration TimeOfReload() {
    scanlocd_->Signal(SIGHUP);
    EXPECT_NE(scanlocd_->ReadLineWith(kBegins), "");
    const Clock::time_point begin = Clock::now();
    EXPECT_NE(scanlocd_->ReadLineWith(kUnchanged), "");
    return Clock::now() - begin;
  }

  const std::string path_ = dir_.File("town.scanloc");
};

TEST_F(KilledReloadTest, LeavesItsMapAsItWas) {
  // Large enough that a load takes many times as long as sending a signal.
  const int num_places = test::LongTests() ? 3000 : 600;
  const int num_moments = test::LongTests() ? 100 : 25;
  test::WriteSmallMap(dir_.File("one"), 1, num_places);
  test::WriteSmallMap(dir_.File("two"), 2, num_places);
  const std::string bytes[] = {test::ReadFile(dir_.File("one")), test::ReadFile(dir_.File("two"))};
  dir_.Write("town.scanloc", bytes[0]);
  std::mt19937 random(7);
  int num_inside = 0;
  std::size_t now = 0;
  for (int i = 0; i < num_moments; ++i) {
    SCOPED_TRACE(i);
    StartLogged();
    ExpectServes(now + 1);
    const Clock::duration whole = TimeOfReload();
    // Every other time the file is new, so that the reload also swaps.
    if (i % 2 == 1) {
      now = 1 - now;
      std::filesystem::rename(dir_.Write("next", bytes[now]), path_);
    }
    scanlocd_->Signal(SIGHUP);
    ASSERT_NE(scanlocd_->ReadLineWith(kBegins), "");
    const Clock::time_point kill_at = Clock::now() + whole * (random() % 1000) / 1000;
    std::this_thread::sleep_until(kill_at);  // any moment will do
    scanlocd_->Signal(SIGKILL);
    ASSERT_EQ(scanlocd_->Wait(), -SIGKILL);
    const std::string& rest = scanlocd_->rest_of_stdout();
    const bool has_ended =
        rest.find(kUnchanged) != std::string::npos || rest.find(kInService) != std::string::npos;
    num_inside += has_ended ? 0 : 1;
    ASSERT_TRUE(test::ReadFile(path_) == bytes[now]) << "the map file has changed";
    EXPECT_FALSE(std::filesystem::exists(path_ + "-journal"));
  }
  StartLogged();
  ExpectServes(now + 1);
  EXPECT_GT(num_inside, num_moments / 2) << "of " << num_moments << " kills fell into a load";
}

}  // namespace
}  // namespace scanloc::server
