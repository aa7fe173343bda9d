#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "support/scenes.hpp"

/// A map in memory of places that the method auto can tell from each other.
namespace scanloc::test {

/// Places 40 m apart with nothing in common, but for those that are given the same scene.
struct PostWorld {
  static constexpr int kNumPosts = 70;

  Params params;
  std::vector<std::uint64_t> scenes;
  std::shared_ptr<const Localizer> localizer;

  explicit PostWorld(std::vector<std::uint64_t> seeds, Params p = {})
      : params(std::move(p)), scenes(std::move(seeds)) {
    auto map = std::make_shared<Map>(MakeEmptyMap(params));
    map->content_id = "posts";
    map->sessions = {"only"};
    auto describer = *Describer::Create(params);
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const auto place = static_cast<std::int32_t>(i);
      map->AppendDescriptor(place, describer.DescribePlace(Scene(place)));
      Pose T_map_place = Pose::Identity();
      T_map_place.translate(Eigen::Vector3d(40.0 * place, 3.0 * place, 0.5));
      T_map_place.rotate(Eigen::AngleAxisd(0.4 * place, Eigen::Vector3d::UnitZ()));
      map->places.push_back({T_map_place, 0, 0});
    }
    localizer = *Localizer::Create(std::move(map));
  }

  [[nodiscard]] PointCloud Scene(std::int32_t place) const {
    return scenes::PostScan(scenes[static_cast<std::size_t>(place)], kNumPosts);
  }
  [[nodiscard]] ScanDescriptor Seen(std::int32_t place, const Pose& T_place_query) const {
    return Describer::Create(params)->Describe(scenes::SeenFrom(Scene(place), T_place_query));
  }
  [[nodiscard]] Answer Ask(const ScanDescriptor& scan, const Query& query = {},
                           const SearchControl& control = {}) const {
    return *localizer->Localize(scan, query, control);
  }
};

inline Pose Offset(double x_m, double y_m, double z_m, double yaw_rad, double roll_rad = 0.0) {
  Pose pose = Pose::Identity();
  pose.translate(Eigen::Vector3d(x_m, y_m, z_m));
  pose.rotate(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()));
  return pose;
}

}  // namespace scanloc::test
