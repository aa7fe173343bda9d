#include "scanloc/report/map_use_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace scanloc::report {
namespace {

TEST(MapUseAsText, ListsPlacesThatAgeWorstFirst) {
  std::vector<Place> places(4);
  for (std::size_t i = 0; i < 3; ++i) {
    places[i].T_map_place.translation().x() = 100.0 * static_cast<double>(i);
  }
  places[3].T_map_place.translation() = Eigen::Vector3d(12.5, -7.0, 0.0);
  MapUse use{.content_id = "abc", .since_ns = 1, .until_ns = 2, .num_localized = 30};
  use.places[0] = {
      .num_found = 10, .confidence = 0.9, .disagreement = 0.2, .recent_disagreement = 0.2};
  use.places[1] = {
      .num_found = 10, .confidence = 0.8, .disagreement = 0.3, .recent_disagreement = 0.6};
  use.places[2] = {.num_refused = 2};  // too seldom to say
  use.places[3] = {.num_found = 1, .num_refused = 9, .confidence = 0.8};
  const std::string text = MapUseAsText(use, places);
  EXPECT_NE(text.find("30 localized"), std::string::npos) << text;
  EXPECT_NE(text.find("3 of 4 were found"), std::string::npos) << text;
  EXPECT_NE(text.find("2 places age"), std::string::npos) << text;
  const std::size_t worst = text.find("       3       12.5       -7.0");
  const std::size_t next = text.find("       1      100.0");
  EXPECT_LT(worst, next) << text;
  EXPECT_NE(next, std::string::npos) << text;
  use.places.erase(1);
  use.places.erase(3);
  EXPECT_NE(MapUseAsText(use, places).find("no place ages"), std::string::npos);
  // A place that the map does not have is no reason to fall over.
  use.places[99] = {.num_refused = 9};
  EXPECT_NE(MapUseAsText(use, places).find("no place ages"), std::string::npos);
  EXPECT_EQ(MapUseToJson(use).at("places").size(), 3U);
}

/// Places 4 m apart along a street, each found ten times, the disagreement of each given.
std::string TextOf(const std::vector<double>& disagreements) {
  std::vector<Place> places(disagreements.size());
  MapUse use;
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].T_map_place.translation().x() = 4.0 * static_cast<double>(i);
    use.places[static_cast<std::int32_t>(i)] = {.num_found = 10,
                                                .recent_disagreement = disagreements[i]};
  }
  return MapUseAsText(use, places);
}

TEST(MapUseAsText, JudgesNeighboursTogether) {
  using testing::HasSubstr;
  EXPECT_THAT(TextOf({.2, .2, .2, .6, .2, .2, .2}), HasSubstr("no place ages")) << "an odd look";
  EXPECT_THAT(TextOf({.2, .2, .2, .6, .6, .6, .6, .2, .2, .2}), HasSubstr("4 places age"));
  EXPECT_THAT(TextOf({.36, .36, .36, .36, .36, .36}), HasSubstr("no place ages"));
  EXPECT_THAT(TextOf({.36, .36, .36, .36, .6, .6, .6, .6}), HasSubstr("8 places age"))
      << "the ends of what was rebuilt see much of what was not";
}

}  // namespace
}  // namespace scanloc::report
