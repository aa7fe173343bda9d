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

/// Turns a scan by whole sectors without moving a point across the edge of a voxel's bin: the test
/// scans keep each point in a voxel of its own.
PointCloud SparseScan(std::uint64_t seed, const Params& params) {
  PointCloud scan;
  const double sector_rad = 2.0 * kPi / params.polar.num_sectors;
  const double ring_m = params.polar.max_range_m / params.polar.num_rings;
  std::uint64_t state = seed;
  for (int i = 0; i < 300; ++i) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const double azimuth_rad = (static_cast<double>((state >> 33) % 60) + 0.5) * sector_rad;
    const double range_m = (static_cast<double>((state >> 40) % 19) + 1.5) * ring_m;
    const double z_m = static_cast<double>((state >> 50) % 100) * 0.1;
    scan.push_back({static_cast<float>(range_m * std::cos(azimuth_rad)),
                    static_cast<float>(range_m * std::sin(azimuth_rad)), static_cast<float>(z_m)});
  }
  return scan;
}

void ExpectPoseNear(const Pose& actual, const Pose& expected) {
  EXPECT_LT((actual.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-9)
      << actual.matrix() << "\nexpected\n"
      << expected.matrix();
}

TEST(Localizer, RecoversEveryTurnOfAWholeSector) {
  Params params;
  params.search.min_voxels = 10;
  auto describer = *Describer::Create(params);
  const PointCloud place_scan = SparseScan(1, params);
  auto map = std::make_shared<Map>(MakeEmptyMap(params));
  map->sessions = {"s"};
  Pose T_map_place = Pose::Identity();
  T_map_place.translate(Eigen::Vector3d(10, 20, 0));
  T_map_place.rotate(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()));
  map->AppendDescriptor(0, describer.DescribePlace(place_scan));
  map->places.push_back({T_map_place, 0, 0});
  const auto localizer = *Localizer::Create(map);

  for (const char* method : {"pc", "a-pc", "pc-naive", "a-pc-naive-brute"}) {
    for (int sector = 0; sector < 60; ++sector) {
      const Pose T_place_query = PlanarOffset(0.0, sector * 2.0 * kPi / 60);
      Query options;
      options.method = *ParseMethod(method);
      const auto answer = localizer->Localize(
          describer.Describe(scenes::SeenFrom(place_scan, T_place_query)), options);
      ASSERT_TRUE(answer.ok()) << answer.status();
      ASSERT_EQ(answer->candidates.size(), 1U);
      const Candidate& best = answer->candidates[0];
      EXPECT_EQ(answer->outcome, Outcome::kLocalized);
      EXPECT_NEAR(WrapAngle(best.yaw_rad - sector * 2.0 * kPi / 60), 0.0, 1e-9);
      EXPECT_GT(best.yaw_rad, -kPi);
      EXPECT_LE(best.yaw_rad, kPi);
      EXPECT_EQ(best.lateral_m, 0.0);
      ExpectPoseNear(best.T_map_query, T_map_place * T_place_query);
    }
  }
}

TEST(Localizer, RecoversEveryShiftOfAWholeColumnAheadAndReversed) {
  Params params;
  params.search.min_voxels = 10;
  for (const ShiftMode mode : {ShiftMode::kCircular, ShiftMode::kBounded}) {
    params.cart.shift_mode = mode;
    auto describer = *Describer::Create(params);
    // Points in the middle of cells, within ±18 m so that none leaves the region when shifted.
    PointCloud place_scan;
    for (const Point& p : scenes::RandomScan(9, 600, 99.0F)) {
      place_scan.push_back({std::floor(p.x / 5.0F) * 5.0F + 2.5F,
                            std::floor(p.y * 0.18F / 2.0F) * 2.0F + 1.0F, p.z});
    }
    auto map = std::make_shared<Map>(MakeEmptyMap(params));
    map->sessions = {"s"};
    map->AppendDescriptor(0, describer.DescribePlace(place_scan));
    map->places.push_back({PlanarOffset(3.0, 0.5), 0, 0});
    const auto localizer = *Localizer::Create(map);
    for (int col = -10; col <= 10; ++col) {
      for (const double yaw_rad : {0.0, kPi}) {
        const Pose T_place_query = PlanarOffset(2.0 * col, yaw_rad);
        Query options;
        options.method = *ParseMethod("a-cc");
        const auto answer = localizer->Localize(
            describer.Describe(scenes::SeenFrom(place_scan, T_place_query)), options);
        ASSERT_TRUE(answer.ok()) << answer.status();
        const Candidate& best = answer->candidates.at(0);
        EXPECT_DOUBLE_EQ(best.lateral_m, 2.0 * col) << "yaw " << yaw_rad;
        EXPECT_DOUBLE_EQ(best.yaw_rad, yaw_rad) << "col " << col;
        ExpectPoseNear(best.T_map_query, map->places[0].T_map_place * T_place_query);
      }
    }
  }
}

TEST(Localizer, TellsABoundedShiftOfMoreThanHalfTheColumns) {
  Params params;
  params.search.min_voxels = 10;
  params.cart.shift_mode = ShiftMode::kBounded;
  params.cart.max_shift_cols = 39;
  auto describer = *Describer::Create(params);
  for (const float side : {1.0F, -1.0F}) {
    // Points in the middle of cells, at 21 to 37 m on one side.
    PointCloud place_scan;
    for (const Point& p : scenes::RandomScan(9, 600, 99.0F)) {
      place_scan.push_back({std::floor(p.x / 5.0F) * 5.0F + 2.5F,
                            side * (std::floor(std::abs(p.y) * 0.09F) * 2.0F + 21.0F), p.z});
    }
    auto map = std::make_shared<Map>(MakeEmptyMap(params));
    map->sessions = {"s"};
    map->AppendDescriptor(0, describer.DescribePlace(place_scan));
    map->places.push_back({Pose::Identity(), 0, 0});
    const auto answer =
        (*Localizer::Create(map))
            ->Localize(
                describer.Describe(scenes::SeenFrom(place_scan, PlanarOffset(side * 44.0F, 0.0))),
                {.method = *ParseMethod("cc")});
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_DOUBLE_EQ(answer->candidates.at(0).lateral_m, side * 44.0);
  }
}

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
        ExpectPoseNear(best.T_map_query,
                       world.localizer->map().places[i].T_map_place * PlanarOffset(lateral_m, kPi));
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
