// `scanloc build` killed at any moment: what was committed is there, and --resume ends in the map
// of an unbroken build.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "e2e/programs.hpp"
#include "support/long_tests.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr int kNumScans = 40;
constexpr int kCommitInterval = 3;

Args With(Args args, const Args& more) {
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

class KilledAtAnyMoment : public testing::Test {
 protected:
  /// The command that is killed, on map_.
  [[nodiscard]] Args Build(const Args& more) const {
    return With({"build", map_, "--scans", drive_.scans, "--poses", drive_.poses, "--session",
                 "long", "--spacing-m", "0", "--threads", "2", "--no-calibrate",
                 "--commit-interval", std::to_string(kCommitInterval)},
                more);
  }

  /// Builds without a break, from what `base` holds; the content id, and how long it takes.
  void BuildUnbroken(const Args& more) {
    const Clock::time_point start = Clock::now();
    MustScanloc(Build(With(more, {"--quiet"})));
    whole_ = Clock::now() - start;
    content_id_ = ContentId(map_);
    fs::remove(map_);
  }

  /// Kills the build some time after a line of its progress, of which it tells one every tenth. It
  /// runs in step with the test: when a line was read it is at most two tenths further, and so
  /// never at its end. Gives how many scans it had told to be done.
  int KillAt(const Args& more, int num_lines, Clock::duration after) {
    Process build(Command(kScanloc, Build(more)), {.merge_stderr = true, .in_step = true});
    std::string line;
    for (int i = 0; i < num_lines; ++i) line = build.ReadLine();
    std::this_thread::sleep_for(after);  // any moment will do
    build.Signal(SIGKILL);
    EXPECT_EQ(build.Wait(), -SIGKILL) << build.rest_of_stdout();
    const std::string& rest = build.rest_of_stdout();
    const std::size_t end = rest.rfind('\n');
    if (end != std::string::npos) {
      const std::size_t begin = end == 0 ? std::string::npos : rest.rfind('\n', end - 1);
      line = rest.substr(begin == std::string::npos ? 0 : begin + 1);
    }
    return line.empty() ? 0 : std::stoi(line);
  }

  /// A seeded moment out of all of the build.
  int KillAtRandom(const Args& more) {
    const int num_lines = static_cast<int>(random_() % 8);
    return KillAt(more, num_lines, whole_ * static_cast<int>(random_() % 1000) / 5000);
  }

  const TempDir dir_;
  const LongDrive drive_ = MakeLongDrive(dir_, kNumScans);
  const std::string map_ = dir_.File("map");
  std::mt19937 random_{17};
  std::string content_id_;
  Clock::duration whole_{};
  const int num_moments_ = LongTests() ? 100 : 25;
};

json Info(const std::string& map) { return json::parse(MustScanloc({"info", map, "--json"})); }

TEST_F(KilledAtAnyMoment, HoldsWhatWasCommittedAndEndsInTheSameMap) {
  BuildUnbroken({});
  std::set<int> num_places_found;
  for (int i = 0; i < num_moments_; ++i) {
    SCOPED_TRACE(i);
    const int num_told = KillAtRandom({});
    const int num_committed = num_told - num_told % kCommitInterval;
    const int num_places = NumPlacesCommitted(map_);
    EXPECT_GE(num_places, num_committed);
    num_places_found.insert(num_places);
    const std::string told = MustScanloc(Build({"--resume", "--quiet"}));
    EXPECT_NE(told.find(content_id_), std::string::npos) << told;
    ASSERT_FALSE(HasFailure());
    fs::remove(map_);
  }
  EXPECT_GT(num_places_found.size(), 5U) << "the moments are spread over the build";
}

TEST_F(KilledAtAnyMoment, LeavesTheSessionsBeforeAsTheyWere) {
  MustScanloc(With(BuildArgs(dir_.File("base")), {"--no-calibrate"}));
  const json before = Info(dir_.File("base"));
  const std::string places_before = MustScanloc({"export", dir_.File("base")});
  fs::copy_file(dir_.File("base"), map_);
  BuildUnbroken({"--append", "--accept-inconsistent"});
  std::set<int> num_places_found;
  for (int i = 0; i < num_moments_; ++i) {
    SCOPED_TRACE(i);
    fs::copy_file(dir_.File("base"), map_);
    const int num_told = KillAtRandom({"--append", "--accept-inconsistent"});
    const ProcessResult verified = Scanloc({"verify", map_, "--recover"});
    ASSERT_EQ(verified.status, 0) << verified.err;
    const json info = Info(map_);
    EXPECT_EQ(info.at("sessions")[0], before.at("sessions")[0]);
    EXPECT_GE(info.at("num_places"), TinyTown::kNumScans + num_told - num_told % kCommitInterval);
    num_places_found.insert(info.at("num_places").get<int>());
    EXPECT_EQ(MustScanloc({"export", map_}).substr(0, places_before.size()), places_before);
    const std::string told =
        MustScanloc(Build({"--append", "--resume", "--accept-inconsistent", "--quiet"}));
    EXPECT_NE(told.find(content_id_), std::string::npos) << told;
    ASSERT_FALSE(HasFailure());
    fs::remove(map_);
  }
  EXPECT_GT(num_places_found.size(), 5U) << "the moments are spread over the build";
}

}  // namespace
}  // namespace scanloc::test
