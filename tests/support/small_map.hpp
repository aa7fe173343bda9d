#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "support/scenes.hpp"

/// Maps in memory of made scans, for tests that need one to ask.
namespace scanloc::test {

/// The scan that place number `place` of SmallMap(seed, ...) was made of.
inline PointCloud PlaceScan(std::uint64_t seed, int place) {
  return scenes::PostScan(seed * 1000 + place, 80);
}

/// A query taken near the place: the scan as seen from beside it, turned.
inline PointCloud QueryScan(std::uint64_t seed, int place) {
  return scenes::SeenFrom(PlaceScan(seed, place), PlanarOffset(0.3, 0.5 + 0.1 * place));
}

/// num_places places a turn and 7 m apart, in two sessions.
inline Map SmallMap(std::uint64_t seed, int num_places, const Params& params = {}) {
  Map map = MakeEmptyMap(params);
  map.content_id = absl::StrCat("content-", seed);
  map.sessions = {"morning", "evening"};
  auto describer = Describer::Create(params).value();
  for (int i = 0; i < num_places; ++i) {
    Place place;
    place.T_map_place =
        Pose(Eigen::Translation3d(7.1 * i, 0.3 * i, 0.01 * i)) * PlanarOffset(0.0, 0.37 * i);
    place.session = i % 2;
    map.places.push_back(place);
    map.AppendDescriptor(i, describer.DescribePlace(PlaceScan(seed, i)));
  }
  return map;
}

/// What to compare a server's answers with.
inline std::shared_ptr<const Localizer> LocalizerOf(Map map) {
  return Localizer::Create(std::make_shared<const Map>(std::move(map))).value();
}

}  // namespace scanloc::test
