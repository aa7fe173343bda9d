#include "scanloc/core/structural/calibrate.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "support/scenes.hpp"

namespace scanloc {
namespace {

using Trial = Calibrator::Trial;

std::shared_ptr<const Map> PostMap(const std::vector<std::uint64_t>& seeds) {
  const Params params;
  auto map = std::make_shared<Map>(MakeEmptyMap(params));
  map->sessions = {"only"};
  auto describer = *Describer::Create(params);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    map->AppendDescriptor(static_cast<std::int32_t>(i),
                          describer.DescribePlace(scenes::PostScan(seeds[i], 80)));
    Pose pose = Pose::Identity();
    pose.translation().x() = 100.0 * static_cast<double>(i);
    map->places.push_back({pose, 0, 0});
  }
  return map;
}

TEST(FindConfusable, NamesTheWorstFirstAndNoneThatIsHarmless) {
  const std::vector<Trial> trials = {{2, 7, 0.4}, {3, 8, 0.7}, {4, 9, 0.1}, {5, 0, 0.0}};
  const std::vector<ConfusablePair> pairs = FindConfusable(trials);
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[0].place, 3);
  EXPECT_EQ(pairs[0].lookalike, 8);
  EXPECT_EQ(pairs[1].place, 2);
  EXPECT_GT(pairs[0].confidence, pairs[1].confidence);
  const std::vector<Trial> many(300, trials[1]);
  EXPECT_EQ(FindConfusable(many).size(), kMaxConfusable);
}

TEST(Calibrator, FindsLookalikesInAMap) {
  // Places 1 and 4 are twins, 300 m apart.
  const Calibrator calibrator(PostMap({1, 2, 3, 4, 2, 6}));
  ASSERT_EQ(calibrator.num_trials(), 6U);
  for (std::int32_t place = 0; place < 6; ++place) {
    const Trial trial = *calibrator.Run(static_cast<std::size_t>(place));
    EXPECT_EQ(trial.place, place);
    if (place == 1 || place == 4) {
      EXPECT_EQ(trial.found, 5 - place);
      EXPECT_GT(trial.confidence, 0.2);
    } else {
      EXPECT_LT(trial.confidence, 0.1) << "its place is not in the map";
    }
  }
}

TEST(Calibrator, GivesTheSameTrialsOnAnyThread) {
  const Calibrator calibrator(PostMap({1, 2, 3, 4}));
  std::vector<Trial> trials(calibrator.num_trials());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    threads.emplace_back([&, i] { trials[i] = *calibrator.Run(i); });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = trials.size(); i-- > 0;) {
    const Trial again = *calibrator.Run(i);
    EXPECT_EQ(again.confidence, trials[i].confidence);
    EXPECT_EQ(again.found, trials[i].found);
  }
}

}  // namespace
}  // namespace scanloc
