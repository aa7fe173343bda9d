#include "scanloc/geo/geo_frame.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace scanloc::geo {
namespace {

// GeographicLib's own CartConvert, with -l 48.1374 11.5755 519, says where these points are.
const GeoOrigin kMunich{48.1374, 11.5755, 519.0, 90.0, Eigen::Vector3d::Zero()};

TEST(GeoFrame, PutsEastNorthAndUpWhereTheyAre) {
  const GeoFrame frame = *GeoFrame::Create(kMunich);
  const GeoPosition there = frame.ToGeo({1000.0, 2000.0, 30.0});
  EXPECT_NEAR(there.latitude_deg, 48.15538, 1e-4);
  EXPECT_NEAR(there.longitude_deg, 11.58895, 1e-4);
  EXPECT_NEAR(there.altitude_m, 549.39, 0.02);  // the earth bends away
  EXPECT_LT((frame.ToMap(there) - Eigen::Vector3d(1000.0, 2000.0, 30.0)).norm(), 1e-6);
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
