#include "scanloc/core/map_use.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace scanloc {
namespace {

Answer AnswerAt(Outcome outcome, std::optional<std::int32_t> place, double confidence = 0.0,
                double distance = 0.0) {
  Answer answer;
  answer.outcome = outcome;
  if (!place) return answer;
  Candidate candidate;
  candidate.place = *place;
  candidate.confidence = confidence;
  candidate.distance = distance;
  answer.candidates.push_back(candidate);
  return answer;
}

TEST(MapUse, CountsWhatWasFoundAndHowWell) {
  MapUse use;
  Count(AnswerAt(Outcome::kLocalized, 4, 0.9, 0.2), {}, 100, use);
  Count(AnswerAt(Outcome::kLocalized, 4, 0.7, 0.4), {}, 200, use);
  Count(AnswerAt(Outcome::kInsufficientScan, {}), 4, 300, use);
  EXPECT_EQ(use.since_ns, 100);
  EXPECT_EQ(use.until_ns, 300);
  EXPECT_EQ(use.num_localized, 2);
  EXPECT_EQ(use.num_insufficient, 1);
  ASSERT_EQ(use.places.size(), 1U);
  const PlaceUse& place = use.places.at(4);
  EXPECT_EQ(place.num_found, 2);
  EXPECT_EQ(place.num_refused, 0);
  EXPECT_NEAR(place.confidence, 0.8, 1e-12);
  EXPECT_NEAR(place.disagreement, 0.3, 1e-12);
  EXPECT_EQ(place.last_found_ns, 200);
  EXPECT_TRUE(Validate(use).ok());
}

TEST(MapUse, CountsRefusedQueriesWhereTheyMostLikelyWere) {
  MapUse use;
  Count(AnswerAt(Outcome::kAmbiguous, 2), 7, 1, use);
  Count(AnswerAt(Outcome::kNotRecognized, {}), 7, 2, use);
  Count(AnswerAt(Outcome::kNotRecognized, {}), {}, 3, use);
  EXPECT_EQ(use.num_ambiguous, 1);
  EXPECT_EQ(use.num_not_recognized, 2);
  EXPECT_EQ(use.num_refused_nowhere, 1);
  EXPECT_EQ(use.places.at(2).num_refused, 1);
  EXPECT_EQ(use.places.at(7).num_refused, 1);
  EXPECT_EQ(use.places.at(7).last_refused_ns, 2);
}

TEST(MapUse, SeesAPlaceAgeThatWasSoundForLong) {
  MapUse use;
  for (int i = 0; i < 1000; ++i) Count(AnswerAt(Outcome::kLocalized, 0, 1.0, 0.1), {}, 1, use);
  EXPECT_NEAR(TroubleOf(use.places.at(0)), 0.1, 1e-9);
  for (int i = 0; i < 20; ++i) Count(AnswerAt(Outcome::kLocalized, 0, 0.6, 0.7), {}, 2, use);
  EXPECT_LT(use.places.at(0).disagreement, 0.15);
  EXPECT_GT(TroubleOf(use.places.at(0)), 0.6);
  Count(AnswerAt(Outcome::kNotRecognized, 1), {}, 3, use);
  EXPECT_EQ(TroubleOf(use.places.at(1)), 1.0);
  EXPECT_EQ(TroubleOf({}), 0.0);
}

TEST(MapUse, RefusesWhatCannotBeCounted) {
  MapUse use;
  use.places[0] = {.num_found = 1, .confidence = 1.0};
  ASSERT_TRUE(Validate(use).ok());
  MapUse bad = use;
  bad.num_ambiguous = -1;
  EXPECT_FALSE(Validate(bad).ok());
  bad = use;
  bad.places[-1] = {};
  EXPECT_FALSE(Validate(bad).ok());
  for (const double share : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    bad = use;
    bad.places[0].disagreement = share;
    EXPECT_FALSE(Validate(bad).ok()) << share;
  }
}

}  // namespace
}  // namespace scanloc
