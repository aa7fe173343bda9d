// web_serve_places COUNT: serves a map named "big" of so many places of a made town's streets until
// its standard input ends. Prints "ready on HOST:PORT".
#include <cstdio>
#include <cstdlib>
#include <random>

#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc {
namespace {

/// Streets 100 m apart, a place every 2 m, in eight sessions.
Map MakeTown(int count) {
  Params params;
  params.polar = {.enabled = true, .num_rings = 4, .num_sectors = 6, .root_shifts_m = {}};
  params.cart.enabled = false;
  params.structure.enabled = false;
  Map map = MakeEmptyMap(params);
  map.content_id = "made";
  for (int i = 0; i < 8; ++i) map.sessions.push_back("drive " + std::to_string(i + 1));
  std::mt19937 random(3);
  constexpr int kPlacesPerStreet = 2000;
  for (int i = 0; i < count; ++i) {
    const int street = i / kPlacesPerStreet;
    const double along_m = 2.0 * (i % kPlacesPerStreet);
    const double across_m = 80.0 * (street / 2) + static_cast<double>(random() % 100) / 100.0;
    Place place;
    place.T_map_place.translation() = street % 2 == 0 ? Eigen::Vector3d(along_m, across_m, 0.0)
                                                      : Eigen::Vector3d(across_m, along_m, 0.0);
    place.session = street % 8;
    place.stamp_ns = 1'600'000'000'000'000'000 + 1'000'000'000LL * i;
    map.places.push_back(place);
    Context context{.num_rows = 4, .num_cols = 6, .cells_cm = std::vector<std::uint16_t>(24)};
    for (std::uint16_t& cell : context.cells_cm) cell = static_cast<std::uint16_t>(random() % 800);
    map.AppendDescriptor(i, {.polar = {context}, .cart = {}, .structure = {}});
    if (i % (count / 20 + 1) == 0 && i > 0) {
      map.confusable.push_back({.place = i, .lookalike = i / 2, .confidence = 0.6});
    }
  }
  return map;
}

}  // namespace
}  // namespace scanloc

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 200'000;
  const scanloc::test::Maps maps = {{"big", scanloc::MakeTown(count)}};
  const auto server = scanloc::test::StartServer(maps);
  std::printf("ready on %s\n", server->address().c_str());
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  return 0;
}
