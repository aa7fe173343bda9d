#include "scanloc/eval/baseline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "scanloc/core/scan_context/match.hpp"
#include "support/scenes.hpp"

namespace scanloc::eval {
namespace {

constexpr int kNumPlaces = 14;

PointCloud PlaceScan(int place) {
  return scenes::RandomScan(70 + static_cast<std::uint64_t>(place), 1500);
}

PointCloud QueryScan(int place) {
  return scenes::SeenFrom(PlaceScan(place), PlanarOffset(1.0, 0.5 + 0.4 * place));
}

/// Of points at all heights, so that no two keys are equally far from a third.
Map TestMap() {
  Map map = MakeEmptyMap({});
  map.sessions = {"one"};
  auto describer = Describer::Create(map.params).value();
  for (int i = 0; i < kNumPlaces; ++i) {
    map.places.push_back({.T_map_place = PlanarOffset(7.0 * i, 0.3 * i)});
    map.AppendDescriptor(i, describer.DescribePlace(PlaceScan(i)));
  }
  return map;
}

ScanDescriptor Describe(const Map& map, const PointCloud& scan) {
  return Describer::Create(map.params).value().Describe(scan);
}

std::int64_t CountingClock() {
  static std::int64_t now_ns = 0;
  return ++now_ns;
}

/// What a slow search says: places by distance, nearest first.
using Ranking = std::vector<std::pair<double, std::int32_t>>;

Ranking ByKeys(const ContextTable& table, const Keys& keys, bool augmented,
               const std::set<std::int32_t>& hidden) {
  std::map<std::int32_t, double> nearest;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::int32_t place = table.entry(i).place;
    if (hidden.contains(place) || (table.entry(i).augmented && !augmented)) continue;
    double sum = 0.0;
    for (std::size_t row = 0; row < keys.retrieval_cm.size(); ++row) {
      const double difference_m = 0.01 * (keys.retrieval_cm[row] - table.retrieval_key_cm(i)[row]);
      sum += difference_m * difference_m;
    }
    const auto [at, is_new] = nearest.emplace(place, std::sqrt(sum));
    if (!is_new) at->second = std::min(at->second, std::sqrt(sum));
  }
  Ranking ranking;
  for (const auto& [place, distance] : nearest) ranking.emplace_back(distance, place);
  std::sort(ranking.begin(), ranking.end());
  return ranking;
}

/// Variant `number` of every place.
ContextTable Variant(const ContextTable& table, std::size_t number) {
  ContextTable variant(table.num_rows(), table.num_cols());
  std::map<std::int32_t, std::size_t> num_seen;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (num_seen[table.entry(i).place]++ != number) continue;
    variant.Append(table.entry(i), table.context(i).cells_cm, table.retrieval_key_cm(i),
                   table.context(i).aligning_cm);
  }
  return variant;
}

void ExpectRanking(const Answer& answer, const Map& map, Ranking expected, std::size_t num) {
  expected.resize(std::min(expected.size(), num));
  ASSERT_EQ(answer.candidates.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(answer.candidates[i].place, expected[i].second) << i;
    EXPECT_NEAR(answer.candidates[i].distance, expected[i].first, 1e-6 * expected[i].first) << i;
    const Pose& T_map_place = map.places[static_cast<std::size_t>(expected[i].second)].T_map_place;
    EXPECT_TRUE(answer.candidates[i].T_map_place.isApprox(T_map_place));
    EXPECT_FALSE(answer.candidates[i].confidence.has_value());
  }
}

TEST(Baseline, IsKnownByName) {
  for (const char* name : {"m2dp", "segmatch", "pc-key", "cc-key", "a-pc-key", "a-cc-key",
                           "a-pc-trees", "a-cc-trees"}) {
    ASSERT_NE(MakeBaseline(name), nullptr) << name;
    EXPECT_EQ(MakeBaseline(name)->name(), name);
    EXPECT_NE(BaselineNames().find(name), std::string::npos);
  }
  for (const char* name : {"auto", "a-pc", "pc-trees", "a-pc-key-brute", ""}) {
    EXPECT_EQ(MakeBaseline(name), nullptr) << name;
  }
}

TEST(KeyOnly, RanksByTheRetrievalKeysAlone) {
  const Map map = TestMap();
  for (const bool is_polar : {true, false}) {
    for (const bool augmented : {true, false}) {
      const std::string name =
          std::string(augmented ? "a-" : "") + (is_polar ? "pc" : "cc") + "-key";
      SCOPED_TRACE(name);
      const std::unique_ptr<Baseline> baseline = MakeBaseline(name);
      EXPECT_FALSE(baseline->takes_candidates());
      baseline->Prepare(map, {});
      for (int place = 0; place < kNumPlaces; ++place) {
        const PointCloud scan = QueryScan(place);
        const ScanDescriptor descriptor = Describe(map, scan);
        std::vector<bool> excluded(kNumPlaces, false);
        if (place % 2 == 1) excluded[static_cast<std::size_t>(place)] = true;
        const Answer answer = baseline->Recognize({.scan = scan,
                                                   .descriptor = descriptor,
                                                   .num_answers = 5,
                                                   .excluded = &excluded,
                                                   .now_ns = &CountingClock});
        const std::set<std::int32_t> hidden =
            place % 2 == 1 ? std::set<std::int32_t>{place} : std::set<std::int32_t>{};
        ExpectRanking(
            answer, map,
            ByKeys(is_polar ? map.polar : map.cart,
                   MakeKeys(is_polar ? descriptor.polar : descriptor.cart), augmented, hidden),
            5);
        EXPECT_GT(answer.times.retrieve_ns, 0);
        EXPECT_EQ(answer.times.describe_ns, 0);
        EXPECT_EQ(answer.times.match_ns, 0);
      }
    }
  }
}

TEST(SeveralTrees, ComparesTheBestOfEachTreeByFullDescriptor) {
  const Map map = TestMap();
  for (const bool is_polar : {true, false}) {
    const std::unique_ptr<Baseline> baseline = MakeBaseline(is_polar ? "a-pc-trees" : "a-cc-trees");
    EXPECT_TRUE(baseline->takes_candidates());
    baseline->Prepare(map, {});
    const ContextTable& table = is_polar ? map.polar : map.cart;
    const AlignOptions align =
        AlignOptionsOf(map.params, is_polar ? DescriptorKind::kPolar : DescriptorKind::kCart);
    for (const int k : {1, 3, 2 * kNumPlaces}) {
      for (int place = 0; place < kNumPlaces; ++place) {
        SCOPED_TRACE(testing::Message() << baseline->name() << " " << k << " " << place);
        const PointCloud scan = QueryScan(place);
        const ScanDescriptor descriptor = Describe(map, scan);
        const Context& context = is_polar ? descriptor.polar : descriptor.cart;
        const Keys keys = MakeKeys(context);
        const ContextView view{context.num_rows, context.num_cols, context.cells_cm,
                               keys.aligning_cm};
        std::map<std::int32_t, double> nearest;
        for (std::size_t number = 0; number < (is_polar ? 3U : 2U); ++number) {
          const ContextTable variant = Variant(table, number);
          Ranking ranking = ByKeys(variant, keys, true, {});
          ranking.resize(std::min<std::size_t>(ranking.size(), static_cast<std::size_t>(k)));
          for (const auto& [key_distance, found] : ranking) {
            const double distance =
                AlignByKey(view, variant.context(static_cast<std::size_t>(found)), align).distance;
            const auto [at, is_new] = nearest.emplace(found, distance);
            if (!is_new) at->second = std::min(at->second, distance);
          }
        }
        Ranking expected;
        for (const auto& [found, distance] : nearest) expected.emplace_back(distance, found);
        std::sort(expected.begin(), expected.end());
        const Answer answer = baseline->Recognize(
            {.scan = scan, .descriptor = descriptor, .num_answers = 10, .num_candidates = k});
        ExpectRanking(answer, map, expected, 10);
      }
    }
  }
}

TEST(SeveralTrees, PassOverTheExcluded) {
  const Map map = TestMap();
  const std::unique_ptr<Baseline> baseline = MakeBaseline("a-pc-trees");
  baseline->Prepare(map, {});
  const PointCloud scan = QueryScan(4);
  const ScanDescriptor descriptor = Describe(map, scan);
  std::vector<bool> excluded(kNumPlaces, true);
  excluded[6] = false;
  const BaselineQuery query{
      .scan = scan, .descriptor = descriptor, .num_answers = 10, .excluded = &excluded};
  const Answer answer = baseline->Recognize(query);
  ASSERT_EQ(answer.candidates.size(), 1U);
  EXPECT_EQ(answer.candidates[0].place, 6);
  excluded[6] = true;
  EXPECT_TRUE(baseline->Recognize(query).candidates.empty());
}

TEST(SeveralTrees, TakesAsManyCandidatesAsTheMapUnlessAsked) {
  Map map = TestMap();
  map.params.search.num_candidates = kNumPlaces;
  const std::unique_ptr<Baseline> baseline = MakeBaseline("a-cc-trees");
  baseline->Prepare(map, {});
  const PointCloud scan = QueryScan(4);
  const ScanDescriptor descriptor = Describe(map, scan);
  const auto count = [&](std::optional<int> k) {
    return baseline
        ->Recognize(
            {.scan = scan, .descriptor = descriptor, .num_answers = 100, .num_candidates = k})
        .candidates.size();
  };
  EXPECT_EQ(count(std::nullopt), std::size_t{kNumPlaces});
  EXPECT_LE(count(1), 2U) << "one of each tree";
}

}  // namespace
}  // namespace scanloc::eval
