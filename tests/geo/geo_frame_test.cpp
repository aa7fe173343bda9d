#include "scanloc/geo/geo_frame.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace scanloc::geo {
namespace {

/// From the middle of the earth [m], by the textbook's formula of the ellipsoid.
Eigen::Vector3d EarthCentred(const GeoPosition& at) {
  constexpr double kA = 6378137.0;
  constexpr double kF = 1.0 / 298.257223563;
  constexpr double kE2 = kF * (2.0 - kF);
  const double phi = at.latitude_deg * std::numbers::pi / 180.0;
  const double lambda = at.longitude_deg * std::numbers::pi / 180.0;
  const double n = kA / std::sqrt(1.0 - kE2 * std::sin(phi) * std::sin(phi));
  return {(n + at.altitude_m) * std::cos(phi) * std::cos(lambda),
          (n + at.altitude_m) * std::cos(phi) * std::sin(lambda),
          (n * (1.0 - kE2) + at.altitude_m) * std::sin(phi)};
}

const GeoOrigin kMunich{48.1374, 11.5755, 519.0, 90.0, Eigen::Vector3d::Zero()};

TEST(GeoFrame, PutsEastNorthAndUpWhereTheyAre) {
  const GeoFrame frame = *GeoFrame::Create(kMunich);
  const GeoPosition there = frame.ToGeo({1000.0, 2000.0, 30.0});
  const double phi = 48.1374 * std::numbers::pi / 180.0;
  const double lambda = 11.5755 * std::numbers::pi / 180.0;
  const Eigen::Vector3d east(-std::sin(lambda), std::cos(lambda), 0.0);
  const Eigen::Vector3d up(std::cos(phi) * std::cos(lambda), std::cos(phi) * std::sin(lambda),
                           std::sin(phi));
  const Eigen::Vector3d expected =
      EarthCentred({48.1374, 11.5755, 519.0}) + 1000.0 * east + 2000.0 * up.cross(east) + 30.0 * up;
  EXPECT_LT((EarthCentred(there) - expected).norm(), 1e-6);
  EXPECT_LT((frame.ToMap(there) - Eigen::Vector3d(1000.0, 2000.0, 30.0)).norm(), 1e-6);
}

TEST(GeoFrame, BringsPriorsIntoTheMap) {
  GeoOrigin origin = kMunich;
  origin.anchor_m = Eigen::Vector3d(700.0, -300.0, 5.0);
  const GeoFrame frame = *GeoFrame::Create(origin);
  const GeoPosition there = frame.ToGeo({3000.0, 4000.0, 30.0});
  Prior asked{.heights = Prior::Heights{1.0, 2.0},
              .sessions = {"march"},
              .on_earth = Prior::GeoDisc{there.latitude_deg, there.longitude_deg, 50.0}};
  const auto prior = InMapFrame(asked, frame);
  ASSERT_TRUE(prior.ok()) << prior.status();
  ASSERT_TRUE(prior->disc.has_value());
  EXPECT_NEAR(prior->disc->x_m, 3000.0, 0.1);
  EXPECT_NEAR(prior->disc->y_m, 4000.0, 0.1);
  EXPECT_EQ(prior->disc->radius_m, 50.0);
  EXPECT_FALSE(prior->on_earth.has_value());
  EXPECT_EQ(prior->heights, asked.heights);
  EXPECT_EQ(prior->sessions, asked.sessions);
  EXPECT_TRUE(absl::IsFailedPrecondition(InMapFrame(asked, std::nullopt).status()));
  EXPECT_EQ(*InMapFrame(Prior{.sessions = {"x"}}, std::nullopt), Prior{.sessions = {"x"}});
  // The other side of the earth lies below the map, and yet far from it.
  for (const double longitude_deg : {kMunich.longitude_deg - 180.0, -160.0, -90.0}) {
    const Prior::Disc far = frame.ToMap(Prior::GeoDisc{-48.1374, longitude_deg, 50.0});
    EXPECT_GT(std::hypot(far.x_m, far.y_m), 5e6) << longitude_deg;
  }
}

TEST(GeoFrame, TurnsByTheHeadingOfX) {
  GeoOrigin north = kMunich;
  north.heading_deg = 0.0;
  const GeoPosition there = (*GeoFrame::Create(north)).ToGeo({100.0, 0.0, 0.0});
  EXPECT_GT(there.latitude_deg, kMunich.latitude_deg + 8e-4);
  EXPECT_NEAR(there.longitude_deg, kMunich.longitude_deg, 1e-12);
  const GeoPosition left = (*GeoFrame::Create(north)).ToGeo({0.0, 100.0, 0.0});
  EXPECT_LT(left.longitude_deg, kMunich.longitude_deg - 1e-3) << "y is to the left of x";
}

TEST(GeoFrame, TellsHeadingsAgainstNorthThere) {
  Pose pose = Pose::Identity();
  const GeoFrame frame = *GeoFrame::Create(kMunich);
  EXPECT_NEAR(frame.ToGeo(pose).heading_deg, 90.0, 1e-9);
  pose.linear() = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(frame.ToGeo(pose).heading_deg, 90.0 - 0.5 * 180.0 / std::numbers::pi, 1e-9);
  // North is elsewhere farther east: the meridians meet at the pole.
  pose.linear().setIdentity();
  pose.translation() = Eigen::Vector3d(100'000.0, 0.0, 0.0);
  const GeoPose east = frame.ToGeo(pose);
  const GeoPosition there = frame.ToGeo(pose.translation());
  EXPECT_EQ(east.latitude_deg, there.latitude_deg);
  EXPECT_EQ(east.longitude_deg, there.longitude_deg);
  EXPECT_EQ(east.altitude_m, there.altitude_m);
  const double meridians = (there.longitude_deg - kMunich.longitude_deg) *
                           std::sin(kMunich.latitude_deg * std::numbers::pi / 180.0);
  EXPECT_NEAR(east.heading_deg, 90.0 + meridians, 0.01);
}

TEST(GeoFrame, TellsOfEveryCandidateOrOfNone) {
  Answer answer;
  answer.candidates.resize(2);
  answer.candidates[1].T_map_query.translation().x() = 10.0;
  TellOnEarth(std::nullopt, answer);
  EXPECT_FALSE(answer.candidates[0].geo.has_value());
  TellOnEarth(*GeoFrame::Create(kMunich), answer);
  EXPECT_NEAR(answer.candidates[0].geo->latitude_deg, kMunich.latitude_deg, 1e-12);
  EXPECT_GT(answer.candidates[1].geo->longitude_deg, kMunich.longitude_deg + 1e-4);
}

TEST(GeoFrame, LosesNothingFarFromTheZeroOfTheMap) {
  GeoOrigin origin = kMunich;
  origin.anchor_m = {1.0e7, -1.0e7, 0.0};
  const GeoFrame frame = *GeoFrame::Create(origin);
  const Eigen::Vector3d at(1.0e7 + 12.34, -1.0e7 + 56.78, 9.01);
  EXPECT_LT((frame.ToMap(frame.ToGeo(at)) - at).norm(), 1e-2);
}

TEST(GeoFrame, NamesGrids) {
  const GeoPosition munich{48.1374, 11.5755, 519.0};
  EXPECT_EQ(UtmText(munich).substr(0, 10), "32n 691603");
  EXPECT_EQ(MgrsText(munich).substr(0, 5), "32UPU");
  EXPECT_EQ(MgrsText(munich).size(), 15U);
}

TEST(GeoFrame, RefusesWhatIsNotOnEarth) {
  for (const auto& [latitude, altitude] :
       {std::pair{91.0, 0.0}, {std::numeric_limits<double>::quiet_NaN(), 0.0}, {0.0, 1e9}}) {
    EXPECT_FALSE(GeoFrame::Create({latitude, 0.0, altitude}).ok());
  }
  GeoOrigin far = kMunich;
  far.anchor_m.x() = 1e12;
  EXPECT_FALSE(GeoFrame::Create(far).ok());
}

}  // namespace
}  // namespace scanloc::geo
