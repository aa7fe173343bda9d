#include "place_tiles.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

namespace scanloc::web {
namespace {

std::vector<Place> RandomPlaces(std::size_t count, double side_m) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> within(0.0, side_m);
  std::vector<Place> places(count);
  for (std::size_t i = 0; i < count; ++i) {
    places[i].T_map_place.translation() =
        Eigen::Vector3d(1e6 + within(random), within(random), 5.0);
    places[i].session = static_cast<int>(i % 3);
  }
  return places;
}

std::uint32_t IndexAt(const std::string& rows, std::size_t row) {
  std::uint32_t index = 0;
  std::memcpy(&index, rows.data() + row * PlaceTiles::kRowBytes, sizeof index);
  return index;
}

TEST(PlaceTiles, HoldsEveryPlaceOnceAndWithinItsSquare) {
  const std::vector<Place> places = RandomPlaces(20'000, 900.0);
  const PlaceTiles tiles("id", places);
  std::set<std::uint32_t> seen;
  for (const PlaceTiles::Tile& tile : tiles.tiles()) {
    const std::string rows = tiles.Rows(tile);
    ASSERT_EQ(rows.size(), tile.count * PlaceTiles::kRowBytes);
    EXPECT_LE(tile.count, 48U * 48U);
    for (std::uint32_t row = 0; row < tile.count; ++row) {
      const std::uint32_t index = IndexAt(rows, row);
      EXPECT_TRUE(seen.insert(index).second);
      float xyz[3];
      std::memcpy(xyz, rows.data() + row * PlaceTiles::kRowBytes + 4, sizeof xyz);
      const Eigen::Vector3d expected = places[index].T_map_place.translation() - tiles.origin_m();
      EXPECT_NEAR(xyz[0], expected.x(), 1e-3);
      EXPECT_GE(xyz[0], tile.min_x_m - 0.01);
      EXPECT_LE(xyz[0], tile.min_x_m + tile.side_m + 0.01);
      EXPECT_GE(xyz[1], tile.min_y_m - 0.01);
      EXPECT_LE(xyz[1], tile.min_y_m + tile.side_m + 0.01);
    }
  }
  EXPECT_EQ(seen.size(), places.size());
}

TEST(PlaceTiles, TheFirstSquareIsASampleOfAll) {
  const PlaceTiles tiles("id", RandomPlaces(20'000, 900.0));
  const PlaceTiles::Tile& first = tiles.tiles().front();
  EXPECT_EQ(first.level, 0);
  EXPECT_GT(first.count, 2000U);  // nearly each cell of it has a place
}

TEST(PlaceTiles, TakesPlacesThatAllLieAtOnePoint) {
  const PlaceTiles tiles("id", std::vector<Place>(10'000));
  std::uint32_t sum = 0;
  for (const PlaceTiles::Tile& tile : tiles.tiles()) sum += tile.count;
  EXPECT_EQ(sum, 10'000U);
  EXPECT_LE(tiles.tiles().size(), 1U + PlaceTiles::kMaxLevel);
}

TEST(PlaceTiles, TakesAMapWithoutPlaces) {
  const PlaceTiles tiles("id", {});
  EXPECT_TRUE(tiles.tiles().empty());
  EXPECT_TRUE(tiles.floors().empty());
}

TEST(PlaceTiles, TellsFloorsApart) {
  std::vector<Place> places = RandomPlaces(300, 50.0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].T_map_place.translation().z() = 3.2 * static_cast<double>(i % 3);
  }
  const PlaceTiles tiles("id", places);
  ASSERT_EQ(tiles.floors().size(), 3U);
  EXPECT_EQ(tiles.floors()[1].count, 100U);
  EXPECT_NEAR(tiles.floors()[2].min_z_m, 6.4, 1e-3);
}

TEST(PlaceTiles, StampsCountFromTheFirst) {
  std::vector<Place> places(3);
  places[0].stamp_ns = 5'000'000'000;
  places[2].stamp_ns = 2'000'000'000;
  const PlaceTiles tiles("id", places);
  EXPECT_EQ(tiles.first_stamp_ns(), 2'000'000'000);
  const std::string rows = tiles.Rows(tiles.tiles().front());
  std::vector<std::uint32_t> stamps(3);
  for (std::size_t row = 0; row < 3; ++row) {
    std::memcpy(&stamps[IndexAt(rows, row)], rows.data() + row * PlaceTiles::kRowBytes + 16, 4);
  }
  EXPECT_EQ(stamps, (std::vector<std::uint32_t>{4, 0, 1}));
}

}  // namespace
}  // namespace scanloc::web
