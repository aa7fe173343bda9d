// How sure an answer is, by the spots that explain the scan and by what supports the best.
#include <gtest/gtest.h>

#include <numbers>

#include "structural/auto_search.hpp"
#include "structural/evidence.hpp"
#include "support/post_world.hpp"

namespace scanloc {
namespace {

using test::Offset;

Support SupportOfMany(double score, double inliers) {
  return {.score = score,
          .sharpness = 0.3,
          .over_mirror = 0.3,
          .inliers = inliers,
          .over_mirror_exactly = 0.3,
          .num_posts = 900};
}

TEST(Confidences, TellApartWhatMayBeEqualByChanceOnlyAsFarAsUndecided) {
  const EvidenceParams params;
  const Support support{.score = 0.8,
                        .sharpness = 0.3,
                        .over_mirror = 0.3,
                        .over_mirror_exactly = 0.3,
                        .num_posts = 400};
  const auto best_of = [&](double rival) {
    return Confidences(std::vector<double>{0.6, rival}, support, 0.0, params).front();
  };
  EXPECT_NEAR(best_of(0.6), 0.5, 0.01);
  EXPECT_GT(best_of(0.59), 0.55);
  EXPECT_LT(best_of(0.59), 0.65);
  EXPECT_NEAR(best_of(0.556), params.undecided, 1e-9) << "equal by chance";
  EXPECT_GT(best_of(0.4), 0.98);
  const std::vector<double> three =
      Confidences(std::vector<double>{0.6, 0.557, 0.556}, support, 0.0, params);
  EXPECT_GT(three[1], three[2]);
  EXPECT_LE(three[0] + three[1] + three[2], 1.0);
}

TEST(Confidences, OfWhoIsBetterThanACohortAreMoreIndoorsMostOfItUpToUndecided) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  const Support support{.score = 0.65,
                        .sharpness = 0.3,
                        .over_mirror = 0.2,
                        .inliers = 0.305,
                        .over_mirror_exactly = 0.2,
                        .num_posts = 900};
  const auto told = [&](double cohort_share, const EvidenceParams& params) {
    return Confidences(std::vector<double>{0.6, 0.4}, support, cohort_share, params).front();
  };
  EXPECT_GT(told(1.0, indoors), told(0.0, indoors));
  EXPECT_NEAR(told(1.0, indoors), indoors.undecided, 1e-9) << "of 3 only 1 counts beyond";
  EXPECT_EQ(told(1.0, {}), told(0.0, {})) << "outdoors it is not looked at";
}

TEST(ConfidencesOf, TellTheBestOfALargeCohortBySmallerLeads) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  const Support clear = SupportOfMany(0.75, 0.5);
  const auto told = [&](int num_alike, double lead, const EvidenceParams& params,
                        double turned_rad = 0.0) {
    std::vector<Spot> spots(1, {.hypothesis = {.score = 0.75}, .score = 0.7, .support = clear});
    for (int i = 1; i <= num_alike; ++i)
      spots.push_back({.score = 0.55, .T_map_query = Offset(5.0 * i, 0.0, 0.0, 0.0)});
    spots[1].score = 0.7 - lead;
    spots[1].T_map_query = Offset(5.0, 0.0, 0.0, turned_rad);
    return ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front();
  };
  EXPECT_NEAR(told(6, 0.06, indoors), indoors.undecided, 1e-9);
  EXPECT_GT(told(12, 0.06, indoors), 0.95);
  EXPECT_NEAR(told(12, 0.03, indoors), indoors.undecided, 1e-9);
  EvidenceParams older = indoors;
  older.equal_in_cohort = 1.0;
  EXPECT_NEAR(told(12, 0.06, older), older.undecided, 1e-9);
  // Turned about, the rival is no other aisle, but perhaps this very one.
  EXPECT_NEAR(told(12, 0.06, indoors, std::numbers::pi), indoors.undecided, 1e-9);
  EXPECT_GT(told(12, 0.11, indoors, std::numbers::pi), 0.95);
}

TEST(ConfidencesOf, BelieveWhatIsAheadOfALargeCohortOfEitherWay) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  const Support fair = SupportOfMany(0.7, 0.31);
  // A dozen spots, some of which look the other way, the best by so much behind.
  const auto told = [&](int num_turned, double lead, const EvidenceParams& params) {
    std::vector<Spot> spots(1, {.hypothesis = {.score = 0.75}, .score = 0.7, .support = fair});
    for (int i = 1; i <= 12; ++i) {
      spots.push_back(
          {.score = 0.7 - lead,
           .T_map_query = Offset(5.0 * i, 0.0, 0.0, i <= num_turned ? std::numbers::pi : 0.0)});
    }
    return ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front();
  };
  EXPECT_GT(told(0, 0.07, indoors), 0.8);
  EXPECT_LE(told(0, 0.05, indoors), indoors.undecided);
  EXPECT_GT(told(6, 0.07, indoors), 0.8);
  EXPECT_LE(told(3, 0.07, indoors), indoors.undecided) << "these may be this hall, turned about";
  EvidenceParams older = indoors;
  older.cohort_lead = 0.0;
  EXPECT_LE(told(0, 0.07, older), older.undecided);
}

TEST(ConfidencesOf, AskMoreOfAHallTurnedAboutWhosePostsAreAlike) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  const Support clear{.score = 0.95,
                      .sharpness = 0.4,
                      .over_mirror = 0.3,
                      .inliers = 0.6,
                      .over_mirror_exactly = 0.3,
                      .num_posts = 900};
  const auto told = [&](double posts_of_rival, double turned_rad) {
    const std::vector<Spot> spots = {
        {.hypothesis = {.score = 0.95}, .score = 0.79, .support = clear},
        {.hypothesis = {.score = posts_of_rival},
         .score = 0.67,
         .T_map_query = Offset(5.0, 0.0, 0.0, turned_rad)}};
    return ConfidencesOf(spots, indoors, Eigen::Vector3d::UnitZ()).front();
  };
  EXPECT_GT(told(0.80, std::numbers::pi), 0.95);
  EXPECT_LE(told(0.91, std::numbers::pi), indoors.undecided);
  EXPECT_GT(told(0.91, 0.0), 0.95) << "another room";
}

TEST(ConfidencesOf, AskMoreOfASpotThatExplainsLittleOfWhatIsSeenAllAround) {
  Support support{.score = 0.85,
                  .sharpness = 0.3,
                  .over_mirror = 0.4,
                  .over_mirror_exactly = 0.4,
                  .num_posts = 400};
  EvidenceParams less;
  less.bias -= 7.0;
  const auto told = [&](double score, const EvidenceParams& params) {
    const std::vector<Spot> spots = {
        {.hypothesis = {.score = score}, .score = score, .support = support}};
    return ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front();
  };
  EXPECT_GT(told(0.61, less), 0.8);
  EXPECT_EQ(told(0.59, less), less.undecided);
  EXPECT_GT(told(0.59, {}), 0.98);
  support.unseen_by_query = 0.7;
  EXPECT_GT(told(0.59, less), 0.8) << "a sensor on its side sees little of what stands there";
}

TEST(ConfidencesOf, DoNotTellFloorsApartByASmallLeadAtAnyScale) {
  const Support sure{.score = 0.9,
                     .sharpness = 0.3,
                     .over_mirror = 0.4,
                     .inliers = 0.7,
                     .over_mirror_exactly = 0.4,
                     .num_posts = 400};
  for (const double scale : {0.35, 1.0}) {
    const EvidenceParams params = AutoParamsAtScale(scale).evidence;
    std::vector<Spot> spots = {{.hypothesis = {.score = 0.8}, .score = 0.75, .support = sure},
                               {.score = 0.62}};
    spots[1].T_map_query.translation().x() = 5.0;
    EXPECT_GT(ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front(), 0.95);
    spots[1].T_map_query.translation() = Eigen::Vector3d(0.3, 0.0, 3.6);
    EXPECT_LE(ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front(), params.undecided);
    spots[1].score = 0.45;
    EXPECT_GT(ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front(), 0.95);
    // That floor a few steps on.
    spots.push_back({.score = 0.62});
    spots[2].T_map_query.translation() = Eigen::Vector3d(5.0, 0.0, 3.6);
    EXPECT_LE(ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front(), params.undecided);
  }
}

TEST(ConfidencesOf, BelieveAScanAloneThatAMapOfNarrowViewsExplainsOnlyOutdoorsAndIfSure) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  std::vector<Spot> spots(1, {.hypothesis = {.score = 0.8}, .score = 0.8});
  Support& support = spots[0].support.emplace();
  support = {.score = 0.85,
             .sharpness = 0.3,
             .over_mirror = 0.4,
             .inliers = 0.7,
             .over_mirror_exactly = 0.4,
             .num_posts = 300};
  const auto confidence = [&](const EvidenceParams& params, double unseen) {
    support.unseen = unseen;
    return ConfidencesOf(spots, params, Eigen::Vector3d::UnitZ()).front();
  };
  EXPECT_EQ(confidence(indoors, 0.4), confidence(indoors, 0.0)) << "a wall that is far off";
  EXPECT_GT(confidence(indoors, 0.4), 0.95);
  EXPECT_EQ(confidence(indoors, 0.8), indoors.undecided);
  EXPECT_EQ(confidence({}, 0.8), confidence({}, 0.0));
  EXPECT_GT(confidence({}, 0.8), 0.98);
  EvidenceParams less;
  less.bias -= 7.0;
  EXPECT_GT(confidence(less, 0.4), 0.8);
  EXPECT_EQ(confidence(less, 0.8), less.undecided);
}

}  // namespace
}  // namespace scanloc
