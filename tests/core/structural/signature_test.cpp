#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "structural/signature_index.hpp"

namespace scanloc {
namespace {

/// Some posts around a spot.
std::vector<Post> SomePosts(std::mt19937_64& random, std::size_t num_posts = 120) {
  std::uniform_int_distribution<int> at_cm(-5500, 5500);
  std::vector<Post> posts(num_posts);
  for (Post& post : posts) {
    post.x_cm = static_cast<std::int16_t>(at_cm(random));
    post.y_cm = static_cast<std::int16_t>(at_cm(random));
  }
  return posts;
}

BearingGrid Turned(const BearingGrid& grid, int num_sectors) {
  BearingGrid::Rings rings = grid.rings();
  for (std::uint64_t& ring : rings) ring = std::rotl(ring, num_sectors);
  return BearingGrid(rings);
}

std::vector<std::int8_t> BearingsPart(const BearingGrid& grid) {
  std::vector<std::int8_t> part(SignatureShape(0, 0).bearings().size);
  WriteBearings(grid.Widened(), 127.0, part);
  return part;
}

double Product(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0) / (127.0 * 127.0);
}

Params NoContexts() {
  Params params;
  params.polar.enabled = false;
  params.cart.enabled = false;
  return params;
}

/// What is seen along a road, where things come and go little by little.
std::vector<BearingGrid> Road(std::size_t num_places, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<BearingGrid> seen;
  BearingGrid::Rings rings{};
  for (std::size_t place = 0; place < num_places; ++place) {
    for (std::uint64_t& ring : rings) {
      if (random() % 3 != 0) continue;
      const std::uint64_t gone = random() & random();
      const std::uint64_t come = random() & random() & random() & random() & random();
      ring = (ring & ~gone) | come;
    }
    seen.emplace_back(rings);
  }
  return seen;
}

Map MapOf(const std::vector<BearingGrid>& seen) {
  Map map = MakeEmptyMap(NoContexts());
  for (const BearingGrid& grid : seen) map.bearings.push_back(grid.Widened());
  return map;
}

SignatureQuery QueryOf(const SignatureIndex& index, const BearingGrid& seen) {
  const std::vector<BearingGrid> spots = {Turned(seen, 11)};
  return index.QueryOf(spots, {}, {});
}

std::vector<std::int32_t> PlacesOf(const SignatureIndex& index, const SignatureQuery& query,
                                   std::size_t k, const SearchControl& control = {}) {
  std::vector<std::int32_t> places;
  for (const auto& [place, spot] : index.MostAlike(query, k, control)) places.push_back(place);
  return places;
}

/// As two threads may do them.
void SecondFirst(const SearchControl::Part& first, const SearchControl::Part& second) {
  second();
  first();
}

TEST(Signature, StaysAsItIsWhenTheScanIsTurned) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20; ++i) {
    const BearingGrid grid(SomePosts(random), 4.0);
    const std::vector<std::int8_t> part = BearingsPart(grid);
    EXPECT_NEAR(Product(part, part), 1.0, 0.01);
    for (const int num_sectors : {1, 16, 37}) {
      const std::vector<std::int8_t> turned = BearingsPart(Turned(grid, num_sectors));
      for (std::size_t c = 0; c < part.size(); ++c) EXPECT_NEAR(part[c], turned[c], 1);
    }
    EXPECT_LT(Product(part, BearingsPart(BearingGrid(SomePosts(random), 4.0))), 0.9);
  }
}

TEST(Signature, TellsAMirroredScanApart) {
  std::mt19937_64 random(2);
  std::vector<Post> posts = SomePosts(random);
  const std::vector<std::int8_t> part = BearingsPart(BearingGrid(posts, 4.0));
  for (Post& post : posts) post.y_cm = static_cast<std::int16_t>(-post.y_cm);
  EXPECT_LT(Product(part, BearingsPart(BearingGrid(posts, 4.0))), 0.9);
}

TEST(Signature, OfNothingIsZero) {
  const std::vector<std::int8_t> part = BearingsPart(BearingGrid(BearingGrid::Rings{}));
  EXPECT_TRUE(std::ranges::all_of(part, [](std::int8_t value) { return value == 0; }));
  std::vector<std::int8_t> of_key(6, 1);
  WriteKey(std::vector<std::int32_t>(5), 63.0, of_key);
  EXPECT_TRUE(std::ranges::all_of(of_key, [](std::int8_t value) { return value == 0; }));
}

TEST(Signature, OfAKeyIsOfUnitLength) {
  std::vector<std::int8_t> part(4, 1);
  WriteKey(std::vector<std::int32_t>{300'000, 0, 400'000}, 100.0, part);
  EXPECT_EQ(part, (std::vector<std::int8_t>{60, 0, 80, 0}));
}

TEST(SignatureRows, AreComparedAlikeByAllKernels) {
  std::mt19937_64 random(3);
  const SignatureShape shape(20, 40);
  std::normal_distribution<float> value;
  const auto row = [&](std::size_t size, double scale, bool is_spike) {
    std::vector<float> values(size);
    for (float& v : values) v = value(random);
    if (is_spike) {
      std::ranges::fill(values, 0.0F);
      values[random() % size] = random() % 2 == 0 ? 1.0F : -1.0F;
    }
    std::vector<std::int8_t> written(size);
    WriteScaled(values, scale, written);
    return written;
  };
  for (const std::size_t num_rows : {1U, 2U, 5U, 7U}) {
    for (int i = 0; i < 20; ++i) {
      SignatureRows rows;
      std::vector<std::vector<std::int8_t>> places;
      for (std::size_t lane = 0; lane < 13; ++lane) {
        std::vector<std::int8_t>& place = places.emplace_back();
        for (const SignatureShape::Part& part : {shape.bearings(), shape.polar(), shape.cart()}) {
          const auto written = row(part.size, SignatureRows::kScale, random() % 3 == 0);
          place.insert(place.end(), written.begin(), written.end());
        }
        rows.Set(lane, place);
      }
      SignatureQuery query;
      std::vector<int> expected(places.size());
      std::vector<int> best_rows(places.size());
      for (const SignatureShape::Part& part : {shape.bearings(), shape.polar(), shape.cart()}) {
        std::vector<int> best(places.size(), std::numeric_limits<int>::min());
        for (std::size_t r = 0; r < num_rows; ++r) {
          // The first is the first place's own part: as much as there can be.
          std::vector<std::int8_t> of_query = row(part.size, 127.0, i % 2 == 0);
          if (r == 0) {
            const auto own = std::span(places[0]).subspan(part.begin, part.size);
            WriteScaled(std::vector<float>(own.begin(), own.end()), i % 3 == 0 ? 127.0 : 63.5,
                        of_query);
          }
          query.Add(part, of_query);
          for (std::size_t lane = 0; lane < places.size(); ++lane) {
            const auto first = places[lane].begin() + static_cast<std::ptrdiff_t>(part.begin);
            const int product = std::inner_product(of_query.begin(), of_query.end(), first, 0);
            if (product <= best[lane]) continue;
            best[lane] = product;
            if (part.begin == 0) best_rows[lane] = static_cast<int>(r);
          }
        }
        for (std::size_t lane = 0; lane < places.size(); ++lane) expected[lane] += best[lane];
      }
      for (const auto& [name, kernel] : signature_rows::Kernels()) {
        SCOPED_TRACE(name);
        SignatureScores scores;
        rows.Compare(0, query, scores, kernel);
        for (std::size_t lane = 0; lane < places.size(); ++lane) {
          EXPECT_EQ(scores.score[lane], expected[lane]);
          EXPECT_EQ(scores.row[lane], best_rows[lane]);
        }
      }
    }
  }
}

TEST(SignatureIndex, FindsWhatIsMostAlikeTheLowerOfEqualPlaces) {
  std::vector<BearingGrid> road;
  for (const BearingGrid& grid : Road(500, 4)) {
    road.push_back(grid);
    // Again, so that there are ties.
    if (road.size() % 5 == 0) road.push_back(grid);
  }
  const Map map = MapOf(road);
  const SignatureIndex index(map, nullptr);
  std::vector<bool> excluded(map.bearings.size());
  for (std::size_t place = 0; place < excluded.size(); place += 3) excluded[place] = true;
  std::vector<std::vector<std::int8_t>> parts;
  for (std::size_t place = 0; place < map.bearings.size(); ++place) {
    std::vector<std::int8_t>& part = parts.emplace_back(SignatureShape(0, 0).bearings().size);
    WriteBearings(map.bearings[place], SignatureRows::kScale, part);
  }
  for (std::size_t q = 0; q < map.bearings.size(); q += 31) {
    std::vector<std::int8_t> of_query(SignatureShape(0, 0).bearings().size);
    WriteBearings(Turned(road[q], 11).Widened(), 127.0, of_query);
    std::vector<std::pair<int, std::int32_t>> by_hand;  // less what they have, place
    for (std::size_t place = 0; place < parts.size(); ++place) {
      by_hand.emplace_back(
          -std::inner_product(of_query.begin(), of_query.end(), parts[place].begin(), 0),
          static_cast<std::int32_t>(place));
    }
    std::ranges::sort(by_hand);
    const SignatureQuery query = QueryOf(index, road[q]);
    const auto all = PlacesOf(index, query, 40);
    ASSERT_EQ(all.size(), 40U);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], by_hand[i].second);
    std::erase_if(by_hand, [&](const auto& place) {
      return excluded[static_cast<std::size_t>(place.second)];
    });
    const auto others = PlacesOf(index, query, 40, {.excluded = &excluded});
    ASSERT_EQ(others.size(), 40U);
    for (std::size_t i = 0; i < others.size(); ++i) EXPECT_EQ(others[i], by_hand[i].second);
  }
  EXPECT_EQ(PlacesOf(index, QueryOf(index, road[0]), 10'000).size(), map.bearings.size());
  EXPECT_TRUE(PlacesOf(index, QueryOf(index, road[0]), 0).empty());
}

TEST(SignatureIndex, FindsAPlaceFromASpotAsideAndByEitherKey) {
  std::mt19937_64 random(5);
  Params params;
  Map map = MakeEmptyMap(params);
  std::vector<std::vector<Post>> scenes;
  const auto key = [&](int num_rows) {
    std::vector<std::int32_t> sums_cm(static_cast<std::size_t>(num_rows));
    for (std::int32_t& sum_cm : sums_cm) sum_cm = static_cast<std::int32_t>(random() % 5000);
    return sums_cm;
  };
  for (std::int32_t place = 0; place < 300; ++place) {
    scenes.push_back(SomePosts(random));
    map.bearings.push_back(BearingsOf(scenes.back(), params));
    map.polar.AppendKey({.place = place}, key(params.polar.num_rings));
    // What the place looks like from a lane aside is not its signature.
    map.polar.AppendKey({.place = place, .augmented = true}, key(params.polar.num_rings));
    map.cart.AppendKey({.place = place}, key(params.cart.num_rows));
    map.cart.AppendFlipOfLast();
  }
  const SignatureIndex index(map, nullptr);
  int num_found = 0;
  int num_from_one_spot = 0;
  for (std::int32_t place = 0; place < 300; place += 10) {
    std::vector<Post> posts = scenes[static_cast<std::size_t>(place)];
    for (Post& post : posts) post.y_cm = static_cast<std::int16_t>(post.y_cm - 700);
    const auto best = [&](const ShortlistParams& shortlist) {
      return index.MostAlike(index.QueryOf(SpotsOf(posts, shortlist), {}, {}), 1, {}).front();
    };
    const SignatureIndex::Found found = best(params.automatic.shortlist);
    EXPECT_EQ(found.spot, 4U) << "seven metres farther to the left than the query stands";
    num_found += found.place == place ? 1 : 0;
    num_from_one_spot += best({.num_asides = 0}).place == place ? 1 : 0;
  }
  EXPECT_EQ(num_found, 30);
  EXPECT_LT(num_from_one_spot, 20);
  const auto context = [](const ContextTable& table, std::size_t entry) {
    const std::vector<std::int32_t> sums_cm = table.retrieval_key_cm(entry);
    Context made;
    made.num_rows = table.num_rows();
    made.num_cols = table.num_cols();
    made.cells_cm.resize(static_cast<std::size_t>(table.num_rows() * table.num_cols()));
    std::ranges::copy(sums_cm, made.cells_cm.begin());  // the first column
    return made;
  };
  for (std::size_t place = 0; place < 300; place += 10) {
    const auto number = static_cast<std::int32_t>(place);
    const Context polar = context(map.polar, 2 * place);
    EXPECT_EQ(PlacesOf(index, index.QueryOf({}, polar, {}), 1).front(), number);
    for (const std::size_t flip : {0U, 1U}) {
      const Context cart = context(map.cart, 2 * place + flip);
      EXPECT_EQ(PlacesOf(index, index.QueryOf({}, {}, cart), 1).front(), number);
    }
  }
}

TEST(SignatureIndex, FindsTheSameHoweverItGrewAndMostOfWhatIsAlikeInALargeMap) {
  const std::vector<BearingGrid> road = Road(5 * SignatureIndex::kMaxExact, 6);
  const Map all = MapOf(road);
  const SignatureIndex at_once(all, nullptr);
  Map map = MakeEmptyMap(NoContexts());
  SignatureIndex grown(map, nullptr);
  for (std::size_t place = 0; place < all.bearings.size(); ++place) {
    map.bearings.push_back(all.bearings[place]);
    if (place % 1001 == 0) grown.Extend();
  }
  grown.Extend();
  const SignatureIndex again(all, &at_once);
  const std::vector<bool> none(all.bearings.size());
  std::size_t num_found = 0;
  constexpr std::size_t kNumFound = 500;
  constexpr std::size_t kStep = 7919;
  for (std::size_t place = 0; place < all.bearings.size(); place += kStep) {
    const SignatureQuery query = QueryOf(at_once, road[place]);
    const auto found = PlacesOf(at_once, query, kNumFound);
    EXPECT_EQ(found.front(), static_cast<std::int32_t>(place));
    EXPECT_EQ(PlacesOf(grown, query, kNumFound), found);
    EXPECT_EQ(PlacesOf(again, query, kNumFound), found);
    EXPECT_EQ(PlacesOf(at_once, query, kNumFound, {.run_both = &SecondFirst}), found);
    for (const std::int32_t exact : PlacesOf(at_once, query, kNumFound, {.excluded = &none})) {
      num_found += static_cast<std::size_t>(std::ranges::count(found, exact));
    }
  }
  const std::size_t num_queries = (all.bearings.size() + kStep - 1) / kStep;
  EXPECT_GT(num_found, 400 * num_queries);
  EXPECT_LT(num_found, 500 * num_queries) << "nothing was left out: a test of nothing";
}

TEST(NumToFind, IsAShareOfAMapWithinBoundsThatGrowAsItsEighthRoot) {
  const ShortlistParams params{.num_places = 100, .found_share = 0.2, .max_found = 1000};
  EXPECT_EQ(NumToFind(params, 100), 200U);
  EXPECT_EQ(NumToFind(params, 4'000), 800U);
  EXPECT_EQ(NumToFind(params, 20'000), 1'000U);
  EXPECT_EQ(NumToFind(params, 256 * 20'000), 2'000U);
}

}  // namespace
}  // namespace scanloc
