// Right, or silent: what else a scan may have been taken at, and where it may be from elsewhere.
#include "structural/evidence.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"
#include "support/building.hpp"
#include "support/post_world.hpp"

namespace scanloc {
namespace {

using test::Building;
using test::Offset;
using test::PostWorld;
using test::RoomScan;

TEST(Shares, AreEqualOfScoresThatAreAlikeAndAddUpToOne) {
  const std::vector<double> shares = Shares(std::vector<double>{0.80, 0.78, 0.5, 0.2}, 400, {});
  EXPECT_DOUBLE_EQ(shares[0], shares[1]);
  EXPECT_LT(shares[2], 0.01);
  EXPECT_GT(shares[2], shares[3]);
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-12);
  EXPECT_TRUE(Shares({}, 400, {}).empty());
}

TEST(Shares, OfFewPostsAreEqualForLonger) {
  const std::vector<double> scores = {0.7, 0.6};
  EXPECT_GT(Shares(scores, 400, {})[0], 0.85);
  EXPECT_DOUBLE_EQ(Shares(scores, 25, {})[0], 0.5);
}

TEST(Shares, OfPosesThatBothExplainNearlyAllAreEqualForLonger) {
  EXPECT_LT(Shares(std::vector<double>{0.95, 0.80}, 400, {})[0], 0.75);
  EXPECT_GT(Shares(std::vector<double>{0.75, 0.60}, 400, {})[0], 0.95);
}

TEST(GenuineLogOdds, AreNoneOfAPoseThatSlides) {
  Support wall{.score = 0.76,
               .sharpness = 0.2,
               .over_mirror = 0.6,
               .over_mirror_exactly = 0.6,
               .num_posts = 240};
  EXPECT_GT(Logistic(GenuineLogOdds(wall, 0.0, {})), 0.95);
  wall.sharpness = 0.05;
  EXPECT_LT(Logistic(GenuineLogOdds(wall, 0.0, {})), 0.6);
}

TEST(SupportLogOdds, GrowsWithWhatSpeaksForAPoseAndFallsWithWhatSpeaksAgainst) {
  const Support support{
      .score = 0.7, .sharpness = 0.1, .over_mirror = 0.2, .contradicted = 0.1, .num_posts = 100};
  const double log_odds = SupportLogOdds(support, {});
  Support other = support;
  other.score = 0.8;
  EXPECT_GT(SupportLogOdds(other, {}), log_odds);
  other = support;
  other.sharpness = 0.05;
  EXPECT_LT(SupportLogOdds(other, {}), log_odds);
  other = support;
  other.over_mirror = 0.1;
  EXPECT_LT(SupportLogOdds(other, {}), log_odds);
  other = support;
  other.contradicted = 0.2;
  EXPECT_LT(SupportLogOdds(other, {}), log_odds);
  other = support;
  other.num_posts = 30;
  EXPECT_LT(SupportLogOdds(other, {}), log_odds);
}

TEST(SupportLogOdds, AreNoneWhereIndoorsNothingFitsExactly) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  Support support{
      .score = 0.9, .sharpness = 0.3, .over_mirror = 0.3, .inliers = 0.5, .num_posts = 300};
  EXPECT_GT(SupportLogOdds(support, indoors), 4.0);
  support.inliers = indoors.least_inliers;
  EXPECT_LE(SupportLogOdds(support, indoors), 0.0);
  EXPECT_GT(SupportLogOdds(support, {}), 4.0) << "outdoors they are not looked at";
}

TEST(GenuineLogOdds, ComeOfHowExactlyPostsLieOnTheMirrorImageIndoors) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  Support room{.score = 0.85,
               .sharpness = 0.3,
               .over_mirror = 0.05,
               .inliers = 0.7,
               .over_mirror_exactly = 0.03,
               .num_posts = 400};
  EXPECT_EQ(GenuineLogOdds(room, 0.0, indoors), 0.0);
  room.over_mirror_exactly = 0.06;
  EXPECT_GT(GenuineLogOdds(room, 0.0, indoors), 2.0);
  EXPECT_EQ(RivalryLogOdds(0.8, 0.8 - 0.06, room.num_posts, indoors), 0.0)
      << "a rival may be so near by chance";
}

TEST(CohortShare, CountHowManySpotsAreAlike) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  std::vector<double> scores = {0.6, 0.3, 0.3};
  EXPECT_EQ(CohortShare(scores, indoors), 0.0) << "no other spot is like it";
  scores.insert(scores.begin() + 1, 4, 0.45);
  EXPECT_DOUBLE_EQ(CohortShare(scores, indoors), 1.0 / 3.0);
  scores.insert(scores.begin() + 1, 10, 0.45);
  EXPECT_DOUBLE_EQ(CohortShare(scores, indoors), 1.0);
  EXPECT_EQ(CohortShare({}, indoors), 0.0);
}

TEST(CohortShare, CountNoSpotThatOnlySomeQueriesLookAtAndNoOtherFloor) {
  const EvidenceParams indoors = AutoParamsAtScale(0.35).evidence;
  std::vector<Spot> spots(1, {.score = 0.6, .T_map_query = Pose::Identity()});
  for (int i = 1; i <= 6; ++i)
    spots.push_back({.score = 0.5, .T_map_query = Offset(5.0 * i, 0.0, 0.0, 0.0)});
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  EXPECT_DOUBLE_EQ(CohortShare(spots, indoors, up), 1.0);
  spots[1].hypothesis.is_usual = false;
  spots[2].T_map_query = Offset(0.0, 0.0, 3.0, 0.0);
  EXPECT_DOUBLE_EQ(CohortShare(spots, indoors, up), 1.0 / 3.0);
}

TEST(SupportOf, IsSharpAmongPostsAndFlatBetweenTwoEndlessWalls) {
  const auto structure = [](const PointCloud& scan) {
    return Describer::Create(Params{})->Describe(scan).structure;
  };
  PointCloud walls;
  for (float x_m = -58.0F; x_m < 58.0F; x_m += 0.25F) {
    for (const float y_m : {-3.0F, 3.0F}) {
      for (const float z_m : {-2.0F, -1.0F, 0.0F, 1.0F}) walls.push_back({x_m, y_m, z_m});
    }
  }
  const auto support_of = [&](const Structure& scene) {
    MatchGrids grids{AutoParams()};
    QueryMatch match(scene, {}, scene.height_m, grids);
    match.SetPlace(scene);
    return SupportOf(match, scene, scene, PlanarPose{});
  };
  const Support among_posts = support_of(structure(scenes::PostScan(3, 70)));
  EXPECT_GT(among_posts.sharpness, 0.3);
  EXPECT_GT(among_posts.over_mirror, 0.3);
  EXPECT_EQ(among_posts.contradicted, 0.0);
  const Support between_walls = support_of(structure(walls));
  EXPECT_LT(between_walls.sharpness, 0.05);
  EXPECT_LT(between_walls.over_mirror, 0.05);
}

/// What stands all around at the same distance, in view_deg of the directions.
Structure Ring(double radius_m, int view_deg = 360) {
  Structure seen;
  for (int deg = 0; deg < view_deg; deg += 2) {
    const double turn = deg * std::numbers::pi / 180.0;
    seen.posts.push_back({static_cast<std::int16_t>(100.0 * radius_m * std::cos(turn)),
                          static_cast<std::int16_t>(100.0 * radius_m * std::sin(turn))});
  }
  return seen;
}

TEST(SupportOf, CountsWhatStandsInFreeSpace) {
  const Structure near = Ring(6.0);
  const Structure far = Ring(12.0);
  MatchGrids grids{AutoParams()};
  QueryMatch match(near, {}, near.height_m, grids);
  match.SetPlace(far);
  // The query's walls stand where the place sees none; the place's stand behind the query's.
  EXPECT_DOUBLE_EQ(SupportOf(match, near, far, PlanarPose{}).contradicted, 1.0);
}

TEST(SupportOf, CountsTheDirectionsInWhichAPlaceShowsNothing) {
  const Structure query = Ring(6.0);
  MatchGrids grids{AutoParams()};
  QueryMatch match(query, {}, query.height_m, grids);
  for (const auto& [view_deg, unseen] : {std::pair(360, 0.0), std::pair(90, 0.75)}) {
    const Structure place = Ring(6.0, view_deg);
    match.SetPlace(place);
    EXPECT_NEAR(SupportOf(match, query, place, PlanarPose{}).unseen, unseen, 0.06) << view_deg;
  }
}

TEST(Evidence, OfAlikeFloorsSaysAmbiguousAndNamesEachWhateverIsUp) {
  for (const Pose& T_map_building : {Pose::Identity(), Offset(3.0, -8.0, 1.0, 0.4, 1.5)}) {
    Building building(T_map_building);
    for (const double height_m : {0.0, 4.0, 8.0}) {
      for (const std::uint64_t scene : {1, 2, 3}) {
        building.Add(scenes::PostScan(scene, 70),
                     Offset(40.0 * static_cast<double>(scene), 0.0, height_m, 0.3));
      }
    }
    const PointCloud seen = scenes::SeenFrom(scenes::PostScan(2, 70), Offset(0.5, 0.3, 0.0, 0.2));
    const Answer answer = *building.Open()->Localize(building.Describe(seen), {.max_answers = 8});
    ASSERT_EQ(answer.outcome, Outcome::kAmbiguous) << answer.reason;
    ASSERT_GE(answer.candidates.size(), 3U);
    double sum_m = 0.0;
    for (int i = 0; i < 3; ++i) {
      const Candidate& candidate = answer.candidates[static_cast<std::size_t>(i)];
      EXPECT_LT(*candidate.confidence, 0.5);
      sum_m += (T_map_building.inverse() * candidate.T_map_query).translation().z();
    }
    EXPECT_NEAR(sum_m, 0.0 + 4.0 + 8.0, 0.5);
  }
}

TEST(Evidence, OfASymmetricalRoomNamesTheTurnedPose) {
  Building building;
  building.Add(RoomScan(7.0F, 5.0F, 1, 0), Offset(0.0, 0.0, 0.0, 0.0));
  const Pose T_room_query = Offset(0.8, 0.4, 0.0, 0.5);
  const PointCloud seen = scenes::SeenFrom(RoomScan(7.0F, 5.0F, 1, 0), T_room_query);
  const Answer answer = *building.Open()->Localize(building.Describe(seen), {.max_answers = 8});
  EXPECT_NE(answer.outcome, Outcome::kLocalized) << answer.reason;
  const Pose turned = Offset(0.0, 0.0, 0.0, std::numbers::pi) * T_room_query;
  EXPECT_TRUE(std::any_of(answer.candidates.begin(), answer.candidates.end(),
                          [&](const Candidate& candidate) {
                            return !MissOf(DifferenceOf(candidate.T_map_query, turned)).any();
                          }));
}

TEST(Evidence, OfAMapOfOneRoomIsSilentAboutOtherRooms) {
  for (const auto& [length_m, width_m] : {std::pair(7.0F, 5.0F), std::pair(12.0F, 8.0F)}) {
    Building building;
    building.Add(RoomScan(length_m, width_m, 1, 8), Pose::Identity());
    const auto localizer = building.Open();
    for (std::uint64_t other = 2; other < 22; ++other) {
      const float grown_m = 0.2F * static_cast<float>(other % 5);
      const PointCloud seen =
          scenes::SeenFrom(RoomScan(length_m + grown_m, width_m - grown_m / 2.0F, other, 8),
                           Offset(0.5, -0.3, 0.0, 0.3 * static_cast<double>(other)));
      const Answer answer = *localizer->Localize(building.Describe(seen), {});
      EXPECT_NE(answer.outcome, Outcome::kLocalized) << other << ": " << answer.reason;
    }
  }
}

TEST(Evidence, IsTheSameHoweverManyCandidatesAreAskedFor) {
  const PostWorld world({1, 2, 3, 4, 5, 6, 7, 8});
  const ScanDescriptor query = world.Seen(3, Offset(0.4, 0.8, 0.0, 2.0));
  const Answer expected = world.Ask(query);
  for (const int candidates : {1, 4, 100, 1000}) {
    const Answer answer = world.Ask(query, {.num_candidates = candidates});
    EXPECT_EQ(*answer.candidates.front().confidence, *expected.candidates.front().confidence);
  }
}

TEST(Evidence, OfFewPostsSaidOftenIsOfFewPosts) {
  const PostWorld world({1, 2, 3});
  ScanDescriptor query = world.Seen(1, Pose::Identity());
  const std::vector<Post> two = {query.structure.posts[0], query.structure.posts[1]};
  query.structure.posts.clear();
  for (int i = 0; i < 15; ++i) {
    query.structure.posts.insert(query.structure.posts.end(), two.begin(), two.end());
  }
  EXPECT_EQ(world.Ask(query).outcome, Outcome::kInsufficientScan);
}

}  // namespace
}  // namespace scanloc
