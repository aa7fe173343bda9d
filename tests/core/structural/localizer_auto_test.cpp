// The method `auto`: candidates from both kinds of context, verified by the scans' structure.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "support/building.hpp"
#include "support/post_world.hpp"
#include "support/same_answer.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

/// Seeds of scenes that are unlike each other.
std::vector<std::uint64_t> ScenesFrom(std::uint64_t first, std::size_t num_scenes) {
  std::vector<std::uint64_t> scenes(num_scenes);
  std::iota(scenes.begin(), scenes.end(), first);
  return scenes;
}

using test::Offset;
using test::PostWorld;

// Posts stand alone here: what a field's cells of 0.5 m blur evens out over walls only.
TEST(LocalizerAuto, FindsPlaceAndPoseInSixDegreesOfFreedom) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  for (const Pose& T_place_query : {Offset(0.8, 1.5, 0.0, 0.1), Offset(-1.0, -2.0, 0.3, 3.1),
                                    Offset(0.5, 2.0, 0.0, 0.0, 0.06)}) {
    for (const std::int32_t place : {0, 3, 5}) {
      const Answer answer = world.Ask(world.Seen(place, T_place_query));
      ASSERT_EQ(answer.outcome, Outcome::kLocalized) << answer.reason;
      const Candidate& best = answer.candidates.front();
      EXPECT_EQ(best.place, place);
      const Pose error = best.T_map_query.inverse() * best.T_map_place * T_place_query;
      EXPECT_LT(error.translation().head<2>().norm(), 0.3);
      EXPECT_LT(std::abs(error.translation().z()), 0.15);
      EXPECT_LT(Eigen::AngleAxisd(error.linear()).angle(), 0.02);
      EXPECT_GT(*best.confidence, 0.8);
      EXPECT_NEAR(best.lateral_m, T_place_query.translation().y(), 0.3);
    }
  }
}

// The keys of a scan from two metres aside, with half of the view, are nearer to those of many
// other places. As many places are verified however many the keys have found.
TEST(LocalizerAuto, FindsInALargerMapWhatManyPlacesHaveNearerKeysThan) {
  constexpr int kNumPlaces = 150;
  const std::vector<std::uint64_t> scenes = ScenesFrom(1000, kNumPlaces);
  const auto num_found = [&](double found_share) {
    Params params;
    params.automatic.shortlist.num_places = 5;
    params.automatic.shortlist.found_share = found_share;
    const PostWorld world(scenes, params);
    auto describer = *Describer::Create(params);
    int num_right = 0;
    for (std::int32_t place = 0; place < kNumPlaces; place += 7) {
      PointCloud seen = scenes::SeenFrom(world.Scene(place), Offset(1.5, 1.5, 0.0, 0.8));
      std::erase_if(seen, [](const Point& p) { return p.x < 0.0F; });
      const Answer answer = world.Ask(describer.Describe(seen));
      const bool is_right = answer.candidates.front().place == place;
      num_right += is_right ? 1 : 0;
      EXPECT_TRUE(is_right || answer.outcome != Outcome::kLocalized);
    }
    return num_right;
  };
  const int num_by_keys = num_found(0.0);
  EXPECT_GE(num_found(0.5), num_by_keys + 10) << num_by_keys << " of 22";
}

// From two lanes aside things stand in other directions than from the place.
TEST(LocalizerAuto, FindsFromLanesAside) {
  constexpr int kNumPlaces = 60;
  const std::vector<std::uint64_t> scenes = ScenesFrom(2000, kNumPlaces);
  const auto num_found = [&](int num_asides) {
    Params params;
    params.automatic.shortlist.num_places = 2;
    params.automatic.shortlist.found_share = 1.0;
    params.automatic.shortlist.num_asides = num_asides;
    const PostWorld world(scenes, params);
    int num_right = 0;
    for (std::int32_t place = 0; place < kNumPlaces; place += 3) {
      const double left_m = place % 2 == 0 ? 7.0 : -7.0;
      const Answer answer = world.Ask(world.Seen(place, Offset(0.0, left_m, 0.0, 0.3)));
      num_right += answer.candidates.front().place == place ? 1 : 0;
    }
    return num_right;
  };
  const int num_from_one_spot = num_found(0);
  EXPECT_GE(num_found(2), num_from_one_spot + 5) << num_from_one_spot << " of 20";
}

TEST(LocalizerAuto, SaysAmbiguousOfTwinsAndNamesBoth) {
  const PostWorld world({1, 2, 3, 4, 2, 6});
  const Answer answer = world.Ask(world.Seen(1, Offset(0.0, 0.5, 0.0, 0.2)), {.max_answers = 5});
  EXPECT_EQ(answer.outcome, Outcome::kAmbiguous) << answer.reason;
  ASSERT_GE(answer.candidates.size(), 2U);
  EXPECT_EQ(answer.candidates[0].place + answer.candidates[1].place, 1 + 4);
  EXPECT_LT(*answer.candidates[0].confidence, 0.8);
  EXPECT_NE(answer.reason.find("two distinct"), std::string::npos) << answer.reason;
}

TEST(LocalizerAuto, SaysNotRecognizedOfASceneThatIsNotInTheMap) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  const PostWorld elsewhere({77});
  const Answer answer = world.Ask(elsewhere.Seen(0, Pose::Identity()));
  EXPECT_EQ(answer.outcome, Outcome::kNotRecognized) << answer.reason;
  ASSERT_FALSE(answer.candidates.empty());
  EXPECT_LT(*answer.candidates[0].confidence, 0.2);
}

TEST(LocalizerAuto, SaysInsufficientWithoutUprightStructure) {
  const PostWorld world({1, 2});
  auto describer = *Describer::Create(world.params);
  const Answer answer = world.Ask(describer.Describe(scenes::PostScan(9, 3)));
  EXPECT_EQ(answer.outcome, Outcome::kInsufficientScan);
  EXPECT_NE(answer.reason.find("3 pieces of upright structure"), std::string::npos)
      << answer.reason;
}

TEST(LocalizerAuto, GivesTheSameBitsOnAnyNumberOfThreads) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  const ScanDescriptor query = world.Seen(2, Offset(1.0, 1.0, 0.0, 2.0));
  const Answer expected = world.Ask(query, {.max_answers = 5});
  std::vector<Answer> answers(8);
  std::vector<std::thread> threads;
  for (Answer& answer : answers) {
    threads.emplace_back([&] { answer = world.Ask(query, {.max_answers = 5}); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Answer& answer : answers) test::ExpectSameAnswer(answer, expected);
}

TEST(LocalizerAuto, LooksAtNoPlaceThatIsExcluded) {
  // The last is the second once more: with one of them excluded the other is the answer.
  const PostWorld world({1, 2, 3, 4, 5, 2});
  const ScanDescriptor query = world.Seen(1, Offset(0.0, 0.5, 0.0, 0.2));
  for (const char* method : {"auto", "a-pc", "a-pc-brute", "a-cc"}) {
    for (const std::int32_t place : {1, 5}) {
      std::vector<bool> excluded(6, true);
      excluded[static_cast<std::size_t>(place)] = false;
      excluded[2] = false;
      const Answer answer =
          world.Ask(query, {.method = *ParseMethod(method), .num_candidates = 6, .max_answers = 6},
                    {.excluded = &excluded});
      ASSERT_FALSE(answer.candidates.empty()) << method;
      EXPECT_EQ(answer.candidates.front().place, place) << method;
      for (const Candidate& candidate : answer.candidates) {
        EXPECT_TRUE(candidate.place == place || candidate.place == 2) << method;
      }
    }
  }
}

TEST(LocalizerAuto, AnswersWithoutCandidatesWhereAllIsExcluded) {
  const PostWorld world({1, 2, 3});
  const std::vector<bool> excluded(3, true);
  for (const char* method : {"auto", "a-pc", "cc-brute"}) {
    const Answer answer = world.Ask(world.Seen(1, Pose::Identity()),
                                    {.method = *ParseMethod(method)}, {.excluded = &excluded});
    EXPECT_EQ(answer.outcome, Outcome::kNotRecognized) << method;
    EXPECT_TRUE(answer.candidates.empty()) << method;
  }
  const std::vector<bool> other_map(2, false);
  EXPECT_EQ(world.localizer->Localize(world.Seen(1, Pose::Identity()), {}, {.excluded = &other_map})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(LocalizerAuto, EndsASearchThatNobodyWaitsFor) {
  const PostWorld world({1, 2, 3, 4, 5, 6});
  const ScanDescriptor query = world.Seen(2, Offset(1.0, 1.0, 0.0, 2.0));
  int num_asked = 0;
  for (const char* method : {"auto", "a-pc", "cc-brute"}) {
    for (const int num_patient : {0, 1}) {
      num_asked = 0;
      const auto answer =
          world.localizer->Localize(query, {.method = *ParseMethod(method)},
                                    {.is_unwanted = [&] { return ++num_asked > num_patient; }});
      EXPECT_EQ(answer.status().code(), absl::StatusCode::kCancelled) << method;
      EXPECT_LE(num_asked, num_patient + 3) << method;
    }
  }
}

TEST(LocalizerAuto, ServesMapsOfEitherKindOfContext) {
  for (const bool polar : {true, false}) {
    Params params;
    params.polar.enabled = polar;
    params.cart.enabled = !polar;
    const PostWorld world({1, 2, 3}, params);
    const Answer answer = world.Ask(world.Seen(1, Offset(0.5, 1.0, 0.0, 0.05)));
    EXPECT_EQ(answer.outcome, Outcome::kLocalized) << answer.reason;
    EXPECT_EQ(answer.candidates.front().place, 1);
  }
}

std::int64_t g_now_ns = 0;
std::int64_t SecondsPassAtEveryLook() { return g_now_ns += 1'000'000'000; }

TEST(LocalizerAuto, AnswersWithTheBestSoFarWhenItsBudgetIsSpent) {
  const PostWorld world({3, 3, 3, 3, 3, 3});
  const ScanDescriptor query = world.Seen(3, Offset(0.3, 0.5, 0.0, 0.1));
  const Query several{.max_answers = 10};
  const Answer answer = world.Ask(query, several, TimedBy(&SecondsPassAtEveryLook, 8'000'000'000));
  ASSERT_FALSE(answer.candidates.empty());
  const Answer whole = world.Ask(query, several);
  EXPECT_LT(answer.candidates.size(), whole.candidates.size());
  // Spent before it began: an answer all the same.
  EXPECT_NE(world.Ask(query, {}, TimedBy(&SecondsPassAtEveryLook, 1)).outcome,
            Outcome::kInsufficientScan);
}

TEST(LocalizerAuto, RefusesTheOptionsOfOtherMethods) {
  const PostWorld world({1, 2});
  const ScanDescriptor query = world.Seen(0, Pose::Identity());
  const auto code = [&](const Query& asked) {
    return world.localizer->Localize(query, asked).status().code();
  };
  EXPECT_EQ(code({.threshold = 0.3}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code({.method = *ParseMethod("a-pc"), .min_confidence = 0.3}),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code({.min_confidence = 1.5}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code({.num_candidates = 1, .min_confidence = 0.99}), absl::StatusCode::kOk);
}

TEST(LocalizerAuto, NeedsStructures) {
  Params params;
  params.structure.enabled = false;
  const PostWorld world({1, 2}, params);
  EXPECT_EQ(
      world.localizer->Localize(world.Seen(0, Pose::Identity()), {.method = *ParseMethod("auto")})
          .status()
          .code(),
      absl::StatusCode::kFailedPrecondition);
  auto map = std::make_shared<Map>(MakeEmptyMap(Params()));
  map->sessions = {"only"};
  map->places.emplace_back();
  EXPECT_EQ(Localizer::Create(map).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(LocalizerAuto, AnswersFromAMapWithoutPlaces) {
  const PostWorld empty(std::vector<std::uint64_t>{});
  const PostWorld world({1});
  const Answer answer = empty.Ask(world.Seen(0, Pose::Identity()));
  EXPECT_EQ(answer.outcome, Outcome::kNotRecognized);
  EXPECT_TRUE(answer.candidates.empty());
}

TEST(LocalizerAuto, WeighsTheBestOfManyAlikeSpotsByThePlacesBesideThem) {
  // So many posts of the query, and others instead of the rest.
  const auto scene = [](int num_same, std::uint64_t others) {
    PointCloud scan = scenes::PostScan(1, num_same);
    const PointCloud more = scenes::PostScan(others, 70 - num_same);
    scan.insert(scan.end(), more.begin(), more.end());
    return scan;
  };
  const Pose T_aisle_beside = Offset(0.0, 2.0, 0.0, 0.0);
  const auto best_aisle = [&](int num_beside) {
    test::Building warehouse;
    warehouse.map->params.automatic.evidence.num_beside = num_beside;
    // By its one place the first is a little better than the second, where the query stands.
    for (const auto& [aisle, num_same, num_same_beside] :
         {std::tuple(0, 70, 45), std::tuple(1, 67, 67), std::tuple(2, 60, 60),
          std::tuple(3, 60, 60), std::tuple(4, 60, 60), std::tuple(5, 60, 60),
          std::tuple(6, 60, 60), std::tuple(7, 60, 60)}) {
      const auto seed = static_cast<std::uint64_t>(100 + 2 * aisle);
      const Pose T_map_aisle = Offset(60.0 * aisle, 0.0, 0.0, 0.0);
      warehouse.Add(scene(num_same, seed), T_map_aisle);
      warehouse.Add(scenes::SeenFrom(scene(num_same_beside, seed + 1), T_aisle_beside),
                    T_map_aisle * T_aisle_beside);
    }
    const PointCloud seen = scenes::SeenFrom(scene(70, 1), Offset(0.3, 0.4, 0.0, 0.2));
    const Answer answer = *warehouse.Open()->Localize(warehouse.Describe(seen), {});
    return std::lround(answer.candidates.front().T_map_query.translation().x() / 60.0);
  };
  EXPECT_EQ(best_aisle(0), 0);
  EXPECT_EQ(best_aisle(2), 1);
}

}  // namespace
}  // namespace scanloc
