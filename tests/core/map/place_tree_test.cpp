#include "map/place_tree.hpp"

#include <gtest/gtest.h>

#include <random>

namespace scanloc {
namespace {

Place At(const Eigen::Vector3d& position_m) {
  Place place;
  place.T_map_place.translate(position_m);
  return place;
}

/// On a coarse grid, so that many are equally near; several on the same spot.
std::vector<Place> GridPlaces(std::mt19937& random, std::size_t num_places, double origin_m) {
  std::uniform_int_distribution<int> step(0, 5);
  std::vector<Place> places;
  for (std::size_t i = 0; i < num_places; ++i) {
    places.push_back(At({origin_m + 4.0 * step(random), 4.0 * step(random), 3.0 * step(random)}));
  }
  return places;
}

std::optional<std::size_t> NearestByLooking(const std::vector<Place>& places,
                                            const Eigen::Vector3d& position_m,
                                            const std::vector<bool>& excluded) {
  std::optional<std::size_t> nearest;
  double least_m2 = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (excluded[i]) continue;
    const double m2 = (places[i].T_map_place.translation() - position_m).squaredNorm();
    if (!nearest || m2 < least_m2) {
      nearest = i;
      least_m2 = m2;
    }
  }
  return nearest;
}

TEST(PlaceTree, FindsTheLowestOfTheNearestPlacesThatAreNotExcluded) {
  std::mt19937 random(7);
  // Far from the origin, as maps in UTM or ECEF coordinates are, all sums are exact on this grid.
  for (const double origin_m : {0.0, 5.0e6}) {
    const std::vector<Place> places = GridPlaces(random, 700, origin_m);
    const PlaceTree tree(places);
    std::uniform_int_distribution<int> half_step(-4, 14);
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d position_m(origin_m + 2.0 * half_step(random), 2.0 * half_step(random),
                                       1.5 * half_step(random));
      std::vector<bool> excluded(places.size());
      for (std::size_t place = 0; place < excluded.size(); ++place) {
        excluded[place] = i % 2 == 1 && random() % 8 != 0;
      }
      EXPECT_EQ(tree.Nearest(position_m, i % 2 == 1 ? &excluded : nullptr),
                NearestByLooking(places, position_m, excluded))
          << position_m.transpose();
    }
  }
}

TEST(PlaceTree, FindsNoneWhereThereIsNone) {
  EXPECT_FALSE(PlaceTree({}).Nearest({1.0, 2.0, 3.0}).has_value());
  const std::vector<Place> places(20, At({1.0, 1.0, 1.0}));
  const std::vector<bool> all(places.size(), true);
  EXPECT_FALSE(PlaceTree(places).Nearest({1.0, 2.0, 3.0}, &all).has_value());
  EXPECT_EQ(PlaceTree(places).Nearest({1.0, 2.0, 3.0}), 0U);
}

TEST(PlaceTree, LooksAtHeightToo) {
  const std::vector<Place> floors = {At({0.0, 0.0, 0.0}), At({0.0, 0.0, 4.0})};
  EXPECT_EQ(PlaceTree(floors).Nearest({1.0, 0.0, 3.0}), 1U);
}

}  // namespace
}  // namespace scanloc
