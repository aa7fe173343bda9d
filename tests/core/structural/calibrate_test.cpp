#include "scanloc/core/structural/calibrate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <thread>

#include "support/scenes.hpp"

namespace scanloc {
namespace {

using Trial = Calibrator::Trial;

double Probability(const Calibration& c, double score, double margin) {
  return 1.0 / (1.0 + std::exp(-(c.bias + c.score_weight * score + c.margin_weight * margin)));
}

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

TEST(FitCalibration, FindsTheLogisticThatTheTrialsWereDrawnFrom) {
  const Calibration truth{-4.0, 6.0, 12.0, 0};
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Trial> trials(20'000);
  for (Trial& trial : trials) {
    trial.is_valid = true;
    trial.score = uniform(random);
    trial.margin = trial.score * uniform(random);
    trial.is_right = uniform(random) < Probability(truth, trial.score, trial.margin);
  }
  const Calibration fitted = FitCalibration(trials);
  EXPECT_EQ(fitted.num_trials, 20'000);
  for (double score = 0.1; score < 1.0; score += 0.2) {
    EXPECT_NEAR(Probability(fitted, score, score / 2), Probability(truth, score, score / 2), 0.03);
  }
}

TEST(FitCalibration, StaysFiniteWhereRightAndWrongAreFarApart) {
  for (const double gap : {0.9, 0.5, 0.1, 0.001}) {
    std::vector<Trial> trials(400);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      trials[i].is_valid = true;
      trials[i].is_right = i % 2 == 0;
      trials[i].score = i % 2 == 0 ? gap : 0.0;
      trials[i].margin = trials[i].score;
    }
    const Calibration fitted = FitCalibration(trials);
    EXPECT_TRUE(std::isfinite(fitted.bias) && std::isfinite(fitted.score_weight) &&
                std::isfinite(fitted.margin_weight));
    EXPECT_GE(Probability(fitted, gap, gap), Probability(fitted, 0.0, 0.0));
    EXPECT_LT(std::abs(fitted.bias), 1000.0);
  }
}

TEST(FitCalibration, KeepsTheDefaultsWithTooFewOfEitherKind) {
  EXPECT_EQ(FitCalibration({}), Calibration());
  std::vector<Trial> trials(100, Trial{.is_valid = true, .is_right = true, .score = 0.9});
  EXPECT_EQ(FitCalibration(trials), Calibration());
  for (std::size_t i = 0; i < 60; ++i) trials[i].is_right = false;
  trials.resize(70);  // 60 wrong, 10 right
  EXPECT_EQ(FitCalibration(trials), Calibration());
}

TEST(FindConfusable, NamesTheWorstFirstAndNoRightAnswer) {
  const std::vector<Trial> trials = {{true, true, 0.9, 0.8, 0.99, 1, 1},
                                     {true, false, 0.5, 0.3, 0.4, 2, 7},
                                     {true, false, 0.8, 0.6, 0.7, 3, 8},
                                     {true, false, 0.1, 0.0, 0.1, 4, 9},
                                     {false, false, 0.9, 0.9, 0.9, 5, 0}};
  const std::vector<ConfusablePair> pairs = FindConfusable(trials);
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[0].place, 3);
  EXPECT_EQ(pairs[0].lookalike, 8);
  EXPECT_EQ(pairs[1].place, 2);
  EXPECT_GT(pairs[0].confidence, pairs[1].confidence);
  const std::vector<Trial> many(300, trials[2]);
  EXPECT_EQ(FindConfusable(many).size(), kMaxConfusable);
}

TEST(Calibrator, FindsPlacesAndLookalikesInAMap) {
  // Places 1 and 4 are twins, 300 m apart.
  const Calibrator calibrator(PostMap({1, 2, 3, 4, 2, 6}));
  ASSERT_EQ(calibrator.num_trials(), 12U);
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < calibrator.num_trials(); ++i) trials.push_back(calibrator.Run(i));
  for (std::size_t i = 0; i < trials.size(); ++i) {
    EXPECT_TRUE(trials[i].is_valid);
    const std::int32_t place = trials[i].place;
    EXPECT_EQ(place, static_cast<std::int32_t>(i / 2));
    const bool has_twin = place == 1 || place == 4;
    if (has_twin) {
      EXPECT_EQ(trials[i].found, 5 - place);
      EXPECT_GT(trials[i].score, 0.3);
    } else {
      EXPECT_LT(trials[i].score, 0.3) << "its place is not in the map";
    }
  }
}

TEST(Calibrator, GivesTheSameTrialsOnAnyThread) {
  const Calibrator calibrator(PostMap({1, 2, 3, 4}));
  std::vector<Trial> trials(calibrator.num_trials());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    threads.emplace_back([&, i] { trials[i] = calibrator.Run(i); });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = trials.size(); i-- > 0;) {
    const Trial again = calibrator.Run(i);
    EXPECT_EQ(again.score, trials[i].score);
    EXPECT_EQ(again.margin, trials[i].margin);
    EXPECT_EQ(again.found, trials[i].found);
  }
}

}  // namespace
}  // namespace scanloc
