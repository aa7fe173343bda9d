#include "scanloc/catalogue/area.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

namespace scanloc::catalogue {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Area OnEarth(std::vector<Corner> corners) {
  return {.corners = std::move(corners), .is_on_earth = true};
}

/// Along a sphere between two points [m].
double AlongSphere_m(const Corner& a, const Corner& b) {
  constexpr double kRadius_m = 6371008.8;
  const auto rad = [](double deg) { return deg * std::numbers::pi / 180.0; };
  const double north = std::sin(rad(b.y - a.y) / 2);
  const double east = std::sin(rad(b.x - a.x) / 2);
  return 2 * kRadius_m *
         std::asin(
             std::sqrt(north * north + std::cos(rad(a.y)) * std::cos(rad(b.y)) * east * east));
}

TEST(ConvexHull, IsConvexAndHoldsAllPoints) {
  EXPECT_THAT(ConvexHull({}), IsEmpty());
  EXPECT_THAT(ConvexHull({{1, 2}, {1, 2}}), ElementsAre(Corner{1, 2}));
  EXPECT_THAT(ConvexHull({{0, 0}, {2, 2}, {1, 1}}), ElementsAre(Corner{0, 0}, Corner{2, 2}));
  EXPECT_THAT(ConvexHull({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 1}, {0, 2}}),
              ElementsAre(Corner{0, 0}, Corner{2, 0}, Corner{2, 2}, Corner{0, 2}));
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 100.0);
  std::vector<Corner> points(500);
  for (Corner& point : points) point = {normal(random), normal(random)};
  const std::vector<Corner> hull = ConvexHull(points);
  EXPECT_LT(hull.size(), 60U);
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Corner& a = hull[i];
    const Corner& b = hull[(i + 1) % hull.size()];
    for (const Corner& point : points) {
      EXPECT_GE((b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x), -1e-9);
    }
  }
}

TEST(DistanceOfAreas, IsThatOfTheirNearestPoints) {
  const Area square{.corners = CornersOf({0, 0, 10, 10})};
  const Area hook{
      .corners = {{20, 0}, {40, 0}, {40, 40}, {0, 40}, {0, 30}, {30, 30}, {30, 10}, {20, 10}}};
  EXPECT_DOUBLE_EQ(Distance_m(square, hook), 10.0);
  EXPECT_DOUBLE_EQ(Distance_m(hook, square), 10.0);
  EXPECT_DOUBLE_EQ(Distance_m({.corners = {{25, 20}}}, hook), 5.0) << "the box holds it";
  EXPECT_DOUBLE_EQ(Distance_m({.corners = {{35, 20}}}, hook), 0.0);
  EXPECT_DOUBLE_EQ(Distance_m({.corners = CornersOf({2, 2, 3, 3})}, square), 0.0);
  EXPECT_DOUBLE_EQ(Distance_m(square, {.corners = CornersOf({2, 2, 3, 3})}), 0.0);
  EXPECT_DOUBLE_EQ(Distance_m(square, {.corners = {{-5, 5}, {15, 5}}}), 0.0) << "it goes through";
  EXPECT_EQ(Distance_m(square, OnEarth({{5, 5}})), std::numeric_limits<double>::infinity());
}

TEST(DistanceOfAreas, IsInMetresOnEarthAndNeverTooLong) {
  for (const double latitude : {0.0, 48.0, -65.0, 80.0}) {
    for (const auto& [east, north] :
         {std::pair(0.01, 0.0), {0.0, 0.01}, {-0.3, 0.2}, {0.5, -0.4}}) {
      const Corner here{11.5, latitude};
      const Corner there{11.5 + east, latitude + north};
      const double expected_m = AlongSphere_m(here, there);
      const double told_m = Distance_m(OnEarth({here}), OnEarth({there}));
      EXPECT_LE(told_m, expected_m * 1.001) << latitude << ' ' << east << ' ' << north;
      EXPECT_GE(told_m, expected_m * 0.985) << latitude << ' ' << east << ' ' << north;
    }
  }
  const Area fiji = OnEarth({{179.9, -17}, {-179.9, -17}, {-179.9, -16}, {179.9, -16}});
  EXPECT_EQ(Distance_m(OnEarth({{180, -16.5}}), fiji), 0.0) << "the 180th meridian goes through";
  EXPECT_EQ(Distance_m(OnEarth({{-179.95, -16.5}}), fiji), 0.0);
  EXPECT_GT(Distance_m(OnEarth({{0, -16.5}}), fiji), 1e7);
}

TEST(Area, RefusesWhatIsNowhere) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Validate(Area()).ok());
  EXPECT_TRUE(Validate(OnEarth({{-180, 90}})).ok());
  EXPECT_FALSE(Validate({.corners = {}}).ok());
  EXPECT_FALSE(Validate({.corners = std::vector<Corner>(Area::kMaxCorners + 1)}).ok());
  for (const Corner& corner : {Corner{181, 0}, Corner{0, 91}, Corner{kNan, 0}, Corner{0, kNan}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(Validate(OnEarth({corner})))) << corner.x;
  }
  EXPECT_FALSE(Validate({.corners = {{2e8, 0}}}).ok());
}

TEST(GeoJsonArea, IsOnePolygonWithoutHoles) {
  const std::string polygon =
      R"({"type": "Polygon", "coordinates": [[[11.5, 48], [11.6, 48, 520], [11.6, 48.1], [11.5, 48]]]})";
  const std::string feature =
      R"({"type": "Feature", "properties": {}, "geometry": )" + polygon + "}";
  const std::string one = R"({"type": "FeatureCollection", "features": [)" + feature + "]}";
  for (const std::string& text : {polygon, feature, one}) {
    const auto area = AreaFromGeoJson(text);
    ASSERT_TRUE(area.ok()) << area.status();
    EXPECT_EQ(*area, OnEarth({{11.5, 48}, {11.6, 48}, {11.6, 48.1}}));
  }
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string(R"({"type": 7})"),
        std::string(R"({"type": "Point", "coordinates": [1, 2]})"),
        std::string(R"({"type": "Polygon"})"),
        std::string(R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 4], [1, 2]]]})"),
        std::string(R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 4], [5, 6], [7, 8]]]})"),
        std::string(R"({"type": "Polygon", "coordinates": [[[1, 2], [3, "x"], [5, 6], [1, 2]]]})"),
        std::string(R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 95], [5, 6], [1, 2]]]})"),
        R"({"type": "Polygon", "coordinates": [[[1, 2], [3, 4], [5, 6], [1, 2]], [[1, 2]]]})" +
            std::string(),
        R"({"type": "FeatureCollection", "features": [)" + feature + "," + feature + "]}"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(AreaFromGeoJson(text).status())) << text;
  }
}

}  // namespace
}  // namespace scanloc::catalogue
