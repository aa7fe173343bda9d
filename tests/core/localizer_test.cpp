#include "scanloc/core/localizer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <thread>

#include "scanloc/core/limits.hpp"
#include "support/same_answer.hpp"
#include "support/scenes.hpp"

namespace scanloc {
namespace {

constexpr double kPi = std::numbers::pi;

/// A map of scenes that have nothing in common, one every 100 m along a bend.
struct World {
  Params params;
  std::vector<PointCloud> scans;
  std::shared_ptr<const Localizer> localizer;

  explicit World(Params p = {}, int num_places = 12) : params(std::move(p)) {
    auto map = std::make_shared<Map>(MakeEmptyMap(params));
    map->content_id = "test";
    map->sessions = {"first", "second"};
    auto describer = *Describer::Create(params);
    for (int i = 0; i < num_places; ++i) {
      scans.push_back(scenes::RandomScan(100 + i, 1'500));
      map->AppendDescriptor(i, describer.DescribePlace(scans.back()));
      Pose pose = Pose::Identity();
      pose.translate(Eigen::Vector3d(100.0 * i, 5.0 * i * i, 1.0));
      pose.rotate(Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitZ()));
      map->places.push_back({pose, i, i % 2});
    }
    localizer = *Localizer::Create(std::move(map));
  }

  absl::StatusOr<Answer> Ask(PointView scan, const char* method, Query query = {},
                             const SearchControl& control = {}) const {
    auto describer = *Describer::Create(params);
    query.method = *ParseMethod(method);
    return localizer->Localize(describer.Describe(scan), query, control);
  }
};

TEST(Localizer, IsTheSameWhoeverBuildsItsTreesInWhateverOrder) {
  const World world;
  const auto map = std::make_shared<const Map>(world.localizer->map());
  const auto made = Localizer::Create(map, [](std::span<const std::function<void()>> tasks) {
    EXPECT_EQ(tasks.size(), 3U) << "auto, polar and cart contexts";
    for (std::size_t i = tasks.size(); i-- > 0;) std::thread(tasks[i]).join();
    return absl::OkStatus();
  });
  ASSERT_TRUE(made.ok()) << made.status();
  const ScanDescriptor scan = Describer::Create(world.params)->Describe(world.scans[3]);
  for (const char* method : {"auto", "a-pc", "a-cc"}) {
    const Query query{.method = *ParseMethod(method)};
    test::ExpectSameAnswer(*(*made)->Localize(scan, query),
                           *world.localizer->Localize(scan, query));
  }
  const auto fail = [](auto) { return absl::ResourceExhaustedError("no thread"); };
  EXPECT_TRUE(absl::IsResourceExhausted(Localizer::Create(map, fail).status()));
}

TEST(Localizer, OfOneMethodAnswersAsThatOfAllAndRefusesOthers) {
  const World world;
  const auto map = std::make_shared<const Map>(world.localizer->map());
  const ScanDescriptor scan = Describer::Create(world.params)->Describe(world.scans[3]);
  const std::array<const char*, 3> methods = {"auto", "a-pc", "a-cc"};
  for (const char* only : methods) {
    const auto made = Localizer::CreateFor(map, *ParseMethod(only));
    ASSERT_TRUE(made.ok()) << made.status();
    for (const char* method : methods) {
      const Query query{.method = *ParseMethod(method)};
      const auto answer = (*made)->Localize(scan, query);
      if (method == only) {
        test::ExpectSameAnswer(*answer, *world.localizer->Localize(scan, query));
      } else {
        EXPECT_TRUE(absl::IsFailedPrecondition(answer.status())) << only << ' ' << method;
      }
    }
  }
}

TEST(Localizer, SaysThatItsMapIsHalfBuilt) {
  const World world;
  auto half = std::make_shared<Map>(world.localizer->map());
  half->complete = false;
  const auto whole_answer = world.Ask(world.scans[5], "pc");
  const auto half_answer = (*Localizer::Create(half))
                               ->Localize(Describer::Create(world.params)->Describe(world.scans[5]),
                                          {.method = *ParseMethod("pc")});
  ASSERT_TRUE(whole_answer.ok() && half_answer.ok());
  EXPECT_EQ(whole_answer->reason.find("half built"), std::string::npos);
  EXPECT_NE(half_answer->reason.find("half built"), std::string::npos) << half_answer->reason;
}

TEST(Localizer, FindsAReversedAndShiftedDriveWithTheAugmentedMethods) {
  const World world;
  for (std::size_t i = 0; i < world.scans.size(); ++i) {
    for (const double lateral_m : {-2.0, 2.0}) {
      const PointCloud query = scenes::SeenFrom(world.scans[i], PlanarOffset(lateral_m, kPi));
      for (const char* method : {"a-pc", "a-cc"}) {
        const auto answer = world.Ask(query, method);
        ASSERT_TRUE(answer.ok());
        const Candidate& best = answer->candidates.at(0);
        EXPECT_EQ(best.place, static_cast<int>(i)) << method;
        EXPECT_NEAR(best.lateral_m, lateral_m, 1e-9) << method;
        EXPECT_NEAR(std::abs(best.yaw_rad), kPi, 1e-9) << method;
        test::ExpectPoseNear(best.T_map_query, world.localizer->map().places[i].T_map_place *
                                                   PlanarOffset(lateral_m, kPi));
      }
    }
  }
}

TEST(Localizer, NamesPlaceSessionAndContentId) {
  const World world;
  const auto answer = world.Ask(world.scans[5], "pc");
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer->content_id, "test");
  EXPECT_EQ(answer->candidates.at(0).place, 5);
  EXPECT_EQ(answer->candidates[0].session, 1);
  EXPECT_EQ(answer->candidates[0].session_name, "second");
  EXPECT_FALSE(answer->candidates[0].confidence.has_value());
}

TEST(Localizer, SaysNotRecognizedAboveTheThresholdAndStillTellsTheBestCandidate) {
  const World world;
  const auto answer = world.Ask(scenes::RandomScan(9999, 1'500), "a-pc", {.threshold = 0.01});
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer->outcome, Outcome::kNotRecognized);
  EXPECT_EQ(answer->candidates.size(), 1U);
}

TEST(Localizer, SaysInsufficientScanForEmptySinglePointAndNanScans) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const World world;
  for (const PointCloud& scan : {PointCloud{}, PointCloud{{1, 1, 1}},
                                 PointCloud(500, {kNan, kNan, kNan}), PointCloud{{500, 0, 0}}}) {
    const auto answer = world.Ask(scan, "a-cc");
    ASSERT_TRUE(answer.ok());
    EXPECT_EQ(answer->outcome, Outcome::kInsufficientScan);
    EXPECT_TRUE(answer->candidates.empty());
    EXPECT_FALSE(answer->reason.empty());
  }
}

TEST(Localizer, AnswersFromAMapWithoutPlaces) {
  const World world({}, 0);
  for (const char* method : {"pc", "a-cc", "a-pc-brute"}) {
    const auto answer = world.Ask(scenes::RandomScan(1, 1'500), method);
    ASSERT_TRUE(answer.ok());
    EXPECT_EQ(answer->outcome, Outcome::kNotRecognized);
    EXPECT_TRUE(answer->candidates.empty());
  }
}

TEST(Localizer, TellsEachPlaceOnceWhenMoreCandidatesAreAskedThanPlaces) {
  const World world({}, 3);
  for (const char* method : {"pc", "a-pc", "a-cc", "a-pc-brute", "a-cc-naive-brute"}) {
    const auto answer =
        world.Ask(world.scans[1], method, {.num_candidates = 50, .max_answers = 50});
    ASSERT_TRUE(answer.ok());
    ASSERT_EQ(answer->candidates.size(), 3U) << method;
    EXPECT_EQ(answer->candidates[0].place, 1);
    EXPECT_LE(answer->candidates[0].distance, answer->candidates[1].distance);
    EXPECT_LE(answer->candidates[1].distance, answer->candidates[2].distance);
  }
}

TEST(Localizer, FindsWithAllCandidatesWhatBruteForceFinds) {
  const World world;
  for (int i = 0; i < 10; ++i) {
    const PointCloud query = scenes::RandomScan(500 + i, 1'500);
    const Query all{.num_candidates = limits::kMaxCandidates};
    for (const auto& [fast, brute] :
         {std::pair{"pc", "pc-brute"}, {"cc-naive", "cc-naive-brute"}}) {
      const auto a = world.Ask(query, fast, all);
      const auto b = world.Ask(query, brute, all);
      ASSERT_TRUE(a.ok() && b.ok());
      EXPECT_EQ(a->candidates.at(0).distance, b->candidates.at(0).distance);
      EXPECT_EQ(a->candidates[0].place, b->candidates[0].place);
    }
  }
}

TEST(Localizer, GivesTheSameAnswersOnAnyNumberOfThreads) {
  const World world;
  const auto ask_all = [&] {
    std::vector<std::pair<int, double>> found;
    for (const PointCloud& scan : world.scans) {
      const auto answer = world.Ask(scenes::SeenFrom(scan, PlanarOffset(1.0, 0.7)), "a-pc");
      found.emplace_back(answer->candidates.at(0).place, answer->candidates[0].distance);
    }
    return found;
  };
  const auto expected = ask_all();
  std::vector<std::vector<std::pair<int, double>>> results(4);
  std::vector<std::thread> threads;
  for (auto& result : results) threads.emplace_back([&] { result = ask_all(); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& result : results) EXPECT_EQ(result, expected);
}

TEST(Localizer, RefusesOptionsOutOfRange) {
  const World world({}, 2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Query& query :
       {Query{.num_candidates = 0}, Query{.num_candidates = -3},
        Query{.num_candidates = limits::kMaxCandidates + 1}, Query{.threshold = nan},
        Query{.threshold = -0.1}, Query{.threshold = 1.5}, Query{.max_answers = 0}}) {
    EXPECT_EQ(world.Ask(world.scans[0], "pc", query).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(Localizer, RefusesAMethodThatTheMapDoesNotServe) {
  Params params;
  params.cart.enabled = false;
  const World world(params, 2);
  EXPECT_EQ(world.Ask(world.scans[0], "a-cc").status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_TRUE(world.Ask(world.scans[0], "a-pc").ok());
}

TEST(Localizer, RefusesDescriptorsOfOtherParameters) {
  const World world({}, 2);
  Params other;
  other.polar.num_rings = 10;
  auto describer = *Describer::Create(other);
  EXPECT_EQ(world.localizer->Localize(describer.Describe(world.scans[0])).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(Localizer, MeasuresItsStagesWithTheClockItIsGiven) {
  const World world;
  static std::int64_t ticks = 0;
  const auto answer = world.Ask(world.scans[0], "pc", {}, {.now_ns = [] { return ticks += 5; }});
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer->times.retrieve_ns, 5);
  EXPECT_EQ(answer->times.match_ns, 5);
}

}  // namespace
}  // namespace scanloc
