#include "scanloc/core/prior.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "scanloc/core/track/tracker.hpp"
#include "support/building.hpp"
#include "support/small_map.hpp"

namespace scanloc {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Prior, RefusesWhatIsOutOfRange) {
  EXPECT_TRUE(Validate(Prior{}).ok());
  for (const Prior::Disc& disc :
       {Prior::Disc{0, 0, 0}, Prior::Disc{0, 0, -1}, Prior::Disc{kNan, 0, 1},
        Prior::Disc{0, 2e8, 1}, Prior::Disc{0, 0, std::numeric_limits<double>::infinity()}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(Prior{.disc = disc}))) << disc.radius_m;
  }
  for (const Prior::Heights& heights :
       {Prior::Heights{1, 1}, Prior::Heights{2, 1}, Prior::Heights{kNan, 1}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(Prior{.heights = heights})));
  }
  for (const Prior::GeoDisc& disc :
       {Prior::GeoDisc{91, 0, 1}, Prior::GeoDisc{0, -181, 1}, Prior::GeoDisc{kNan, 0, 1},
        Prior::GeoDisc{0, kNan, 1}, Prior::GeoDisc{0, 0, 0}, Prior::GeoDisc{0, 0, kNan}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(Prior{.on_earth = disc}))) << disc.latitude_deg;
  }
  EXPECT_TRUE(Validate(Prior{.on_earth = Prior::GeoDisc{48, 11, 500}}).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(
      Validate(Prior{.disc = Prior::Disc{0, 0, 1}, .on_earth = Prior::GeoDisc{48, 11, 500}})));
  Prior many;
  many.sessions.assign(1001, "x");
  EXPECT_TRUE(absl::IsInvalidArgument(Validate(many)));
}

/// Eight places 7 m apart along x, in sessions "morning" and "evening" by turns.
class PriorTest : public testing::Test {
 protected:
  const std::shared_ptr<const Localizer> localizer_ = test::LocalizerOf(test::SmallMap(1, 8));
  const ScanDescriptor scan_ =
      Describer::Create(Params{})->Describe(test::QueryScan(1, 3));  // at (21.3, 0.9)
};

TEST_F(PriorTest, IsNotLeftOutWhereNobodyBroughtItIntoTheMap) {
  const Query query{.prior = {.on_earth = Prior::GeoDisc{48, 11, 500}}};
  EXPECT_TRUE(absl::IsInvalidArgument(localizer_->Localize(scan_, query).status()));
}

TEST_F(PriorTest, LeavesOutPlacesElsewhere) {
  for (const char* method : {"auto", "a-pc", "pc-brute"}) {
    const auto place = [&](const Prior& prior) {
      const auto answer =
          localizer_->Localize(scan_, {.method = *ParseMethod(method), .prior = prior});
      EXPECT_TRUE(answer.ok()) << answer.status();
      return answer->candidates.at(0).place;
    };
    EXPECT_EQ(place({.disc = {{21.3, 0.9, 5.0}}}), 3) << method;
    EXPECT_NE(place({.disc = {{0.0, 0.0, 10.0}}}), 3) << method;
    EXPECT_EQ(place({.sessions = {"evening"}}), 3) << method;
    EXPECT_EQ(place({.sessions = {"morning"}}) % 2, 0) << method;
    EXPECT_EQ(place({.heights = {{0.025, 0.035}}}), 3) << method;
    EXPECT_NE(place({.heights = {{0.035, 1.0}}}), 3) << method;
  }
}

TEST_F(PriorTest, WithoutAPlaceIsAnsweredSo) {
  const Query query{.prior = {.disc = {{500.0, 0.0, 10.0}}}};
  const auto answer = localizer_->Localize(scan_, query);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->outcome, Outcome::kNotRecognized);
  EXPECT_EQ(answer->reason, "no place of the map lies where the prior says");
  const auto told = Tracker::Create(localizer_, {.query = query})->Update(scan_);
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(told->answer.outcome, Outcome::kNotRecognized);
}

TEST_F(PriorTest, OfASessionThatIsNotThereIsRefusedByName) {
  const Query query{.prior = {.sessions = {"morning", "noon"}}};
  const absl::Status status = localizer_->Localize(scan_, query).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_NE(status.message().find("\"noon\""), std::string::npos) << status;
  EXPECT_NE(status.message().find("morning, evening"), std::string::npos) << status;
  EXPECT_TRUE(absl::IsInvalidArgument(
      Tracker::Create(localizer_, {.query = query})->Update(scan_).status()));
}

TEST(Prior, OfAFloorTellsAlikeFloorsApart) {
  test::Building building;
  const PointCloud room = scenes::PostScan(5, 120, 30.0F);
  for (int floor = 0; floor < 3; ++floor) {
    building.Add(room, Pose(Eigen::Translation3d(0.0, 0.0, 3.5 * floor)));
  }
  const auto localizer = building.Open();
  const ScanDescriptor scan = building.Describe(scenes::SeenFrom(room, PlanarOffset(0.3, 0.6)));
  EXPECT_EQ(localizer->Localize(scan)->outcome, Outcome::kAmbiguous);
  const Query query{.prior = {.heights = {{2.5, 4.5}}}};
  const Answer answer = *localizer->Localize(scan, query);
  EXPECT_EQ(answer.outcome, Outcome::kLocalized) << answer.reason;
  EXPECT_EQ(answer.candidates.at(0).place, 1);
  const TrackedAnswer told = *Tracker::Create(localizer, {.query = query})->Update(scan);
  EXPECT_EQ(told.answer.outcome, Outcome::kLocalized) << told.answer.reason;
  EXPECT_EQ(told.answer.candidates.at(0).place, 1);
}

}  // namespace
}  // namespace scanloc
