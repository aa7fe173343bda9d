#include "scanloc/report/map_use_text.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace scanloc::report {
namespace {

TEST(MapUseAsText, ListsPlacesThatAgeWorstFirst) {
  std::vector<Place> places(4);
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
  const std::size_t next = text.find("       1        0.0");
  EXPECT_LT(worst, next) << text;
  EXPECT_NE(next, std::string::npos) << text;
  use.places.erase(1);
  use.places.erase(3);
  EXPECT_NE(MapUseAsText(use, places).find("no place ages"), std::string::npos);
  // A place that the map does not have is no reason to fall over.
  use.places[99] = {.num_refused = 9};
  EXPECT_NE(MapUseAsText(use, places).find("1 places age"), std::string::npos);
  EXPECT_EQ(MapUseToJson(use).at("places").size(), 3U);
}

}  // namespace
}  // namespace scanloc::report
