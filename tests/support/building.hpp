#pragma once

#include <memory>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "support/scenes.hpp"

namespace scanloc::test {

/// Places put together one by one, wherever they are said to be.
struct Building {
  explicit Building(Pose T_map_building_in = Pose::Identity())
      : T_map_building(T_map_building_in), map(std::make_shared<Map>(MakeEmptyMap({}))) {
    map->sessions = {"only"};
  }

  void Add(const PointCloud& scan, const Pose& T_building_place) {
    map->AppendDescriptor(static_cast<std::int32_t>(map->places.size()),
                          describer.DescribePlace(scan));
    map->places.push_back({T_map_building * T_building_place, 0, 0});
  }
  [[nodiscard]] std::shared_ptr<const Localizer> Open() const { return *Localizer::Create(map); }
  [[nodiscard]] ScanDescriptor Describe(const PointCloud& scan) { return describer.Describe(scan); }

  Pose T_map_building;
  std::shared_ptr<Map> map;
  Describer describer = *Describer::Create(Params{});
};

/// The walls of a room about the origin, whatever stands in it, and its floor.
inline PointCloud RoomScan(float length_m, float width_m, std::uint64_t furniture_seed,
                           int num_things) {
  PointCloud scan = scenes::PostScan(furniture_seed, num_things, width_m / 2.0F - 0.8F);
  const auto post = [&](float x_m, float y_m) {
    for (int k = 0; k <= 6; ++k) scan.push_back({x_m, y_m, -2.0F + 0.5F * static_cast<float>(k)});
  };
  constexpr float kStep_m = 0.25F;
  for (float x_m = -length_m / 2.0F; x_m <= length_m / 2.0F; x_m += kStep_m) {
    post(x_m, -width_m / 2.0F);
    post(x_m, width_m / 2.0F);
  }
  for (float y_m = -width_m / 2.0F; y_m <= width_m / 2.0F; y_m += kStep_m) {
    post(-length_m / 2.0F, y_m);
    post(length_m / 2.0F, y_m);
  }
  return scan;
}

}  // namespace scanloc::test
