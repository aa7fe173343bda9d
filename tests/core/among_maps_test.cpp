#include "scanloc/core/among_maps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "structural/evidence.hpp"

namespace scanloc {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kNumPosts = 400;

/// What `auto` says where the best of some spots is supported by itself to a degree.
MapAnswer Auto(const std::string& map, std::vector<double> scores, double supported = 0.99) {
  MapAnswer told{.map = map, .num_posts = kNumPosts};
  const std::vector<double> shares = Shares(scores, kNumPosts, told.params.automatic.evidence);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    Candidate candidate;
    candidate.place = static_cast<std::int32_t>(i);
    candidate.distance = 1.0 - scores[i];
    candidate.confidence = supported * shares[i];
    told.answer.candidates.push_back(candidate);
  }
  const bool is_sure = supported * shares.front() >= told.params.search.min_confidence;
  told.answer.outcome = is_sure ? Outcome::kLocalized : Outcome::kNotRecognized;
  told.answer.reason = "as by one map";
  told.answer.content_id = "content of " + map;
  told.answer.spot_scores = std::move(scores);
  return told;
}

MapAnswer Paper(const std::string& map, double distance, Outcome outcome) {
  MapAnswer told{.map = map};
  told.answer.outcome = outcome;
  told.answer.candidates.emplace_back().distance = distance;
  return told;
}

TEST(AmongMaps, TellsTheMapThatFits) {
  const MapAnswer told =
      AmongMaps({Auto("north", {0.3, 0.28}, 0.01), Auto("south", {0.62, 0.3})}, {});
  EXPECT_EQ(told.map, "south");
  EXPECT_EQ(told.answer.content_id, "content of south");
  EXPECT_EQ(told.answer.outcome, Outcome::kLocalized);
  EXPECT_EQ(told.answer.reason, "as by one map");
  ASSERT_EQ(told.answer.candidates.size(), 1U);
  EXPECT_EQ(told.answer.candidates[0].map, "south");
}

TEST(AmongMaps, IsAsSureAsOneMapOfAllTheirSpotsWouldBe) {
  const std::vector<double> north = {0.60, 0.55, 0.41};
  const std::vector<double> south = {0.52, 0.5, 0.49, 0.2};
  std::vector<double> all = north;
  all.insert(all.end(), south.begin(), south.end());
  const MapAnswer told = AmongMaps({Auto("north", north), Auto("south", south)}, {});
  EXPECT_NEAR(told.answer.candidates[0].confidence.value(),
              0.99 * Shares(all, kNumPosts, EvidenceParams())[0], 1e-12);
}

TEST(AmongMaps, IsAmbiguousWhereAnotherMapFitsAsWell) {
  for (const double rival : {0.60, 0.62, 0.64}) {  // whichever is the better by chance
    SCOPED_TRACE(rival);
    const MapAnswer told =
        AmongMaps({Auto("north", {0.62, 0.3}), Auto("south", {rival, 0.3})}, {.max_answers = 3});
    EXPECT_EQ(told.answer.outcome, Outcome::kAmbiguous);
    EXPECT_THAT(told.answer.reason, HasSubstr("two maps explain the scan"));
    EXPECT_LT(told.answer.candidates[0].confidence.value(), 0.5);
    ASSERT_EQ(told.answer.candidates.size(), 3U);
    EXPECT_NE(told.answer.candidates[0].map, told.answer.candidates[1].map);
  }
}

TEST(AmongMaps, IsAmbiguousBesideABetterSpotThatItsOwnMapDoubts) {
  const MapAnswer told = AmongMaps({Auto("north", {0.62}), Auto("south", {0.7}, 0.1)}, {});
  EXPECT_EQ(told.answer.outcome, Outcome::kAmbiguous);
  EXPECT_EQ(told.map, "north");
}

TEST(AmongMaps, LocalizesNothingThatNoMapLocalizes) {
  const MapAnswer told = AmongMaps({Auto("north", {0.5}, 0.2), Auto("south", {0.4}, 0.1)}, {});
  EXPECT_EQ(told.answer.outcome, Outcome::kNotRecognized);
  EXPECT_EQ(told.map, "north");
}

TEST(AmongMaps, IsAsSureAsTheQueryAsks) {
  const auto ask = [](double min_confidence) {
    return AmongMaps({Auto("north", {0.62}), Auto("south", {0.62})},
                     {.min_confidence = min_confidence})
        .answer.outcome;
  };
  EXPECT_EQ(ask(0.5), Outcome::kAmbiguous);
  EXPECT_EQ(ask(0.4), Outcome::kLocalized);
}

TEST(AmongMaps, PassesOverMapsWithNothingToCompare) {
  MapAnswer empty{.map = "empty"};
  const MapAnswer told = AmongMaps({empty, Auto("south", {0.62})}, {});
  EXPECT_EQ(told.map, "south");
  EXPECT_EQ(told.answer.outcome, Outcome::kLocalized);
  EXPECT_TRUE(AmongMaps({empty, empty}, {}).answer.candidates.empty());
}

TEST(AmongMaps, TakesThePapersMethodsAtTheirWordWhereOneMapRecognizesTheScan) {
  const Outcome yes = Outcome::kLocalized, no = Outcome::kNotRecognized;
  const auto ask = [](Outcome north, Outcome south) {
    return AmongMaps({Paper("north", 0.2, north), Paper("south", 0.1, south)}, {});
  };
  EXPECT_EQ(ask(no, yes).answer.outcome, Outcome::kLocalized);
  EXPECT_EQ(ask(no, yes).map, "south");
  EXPECT_EQ(ask(yes, yes).answer.outcome, Outcome::kAmbiguous);
  EXPECT_EQ(ask(no, no).answer.outcome, Outcome::kNotRecognized);
}

}  // namespace
}  // namespace scanloc
