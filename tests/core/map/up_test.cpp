#include "scanloc/core/map/up.hpp"

#include <gtest/gtest.h>

#include "support/building.hpp"

namespace scanloc {
namespace {

using test::Building;

Pose Turned(double angle_rad, const Eigen::Vector3d& axis) {
  return Pose(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

TEST(FindUp, IsWhereTheGroundSaysWhateverTheFrame) {
  for (const Pose& T_map_building :
       {Pose::Identity(), Turned(1.5, {1.0, 0.0, 0.0}), Turned(2.2, {1.0, -2.0, 0.5})}) {
    Building building(T_map_building);
    for (int i = 0; i < 5; ++i) {
      building.Add(scenes::PostScan(static_cast<std::uint64_t>(i), 40),
                   Turned(0.7 * i, Eigen::Vector3d::UnitZ()));
    }
    // One place that was put in upside down.
    building.Add(scenes::PostScan(9, 40), Turned(3.0, {1.0, 0.0, 0.0}));
    const auto up = FindUp(*building.map);
    ASSERT_TRUE(up.ok()) << up.status();
    EXPECT_LT((*up - T_map_building.linear().col(2)).norm(), 0.1) << up->transpose();
  }
}

TEST(FindUp, RefusesPlacesThatDoNotAgree) {
  Building building;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  for (const Pose& pose : {Turned(0.0, x), Turned(1.57, x), Turned(-1.57, x), Turned(3.14, x),
                           Turned(1.57, y), Turned(-1.57, y)}) {
    building.Add(scenes::PostScan(building.map->places.size(), 40), pose);
  }
  const absl::Status status = Localizer::Create(building.map).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("is up"), std::string::npos) << status;
}

TEST(FindUp, IsZWithoutStructures) {
  EXPECT_EQ(*FindUp(MakeEmptyMap({})), Eigen::Vector3d::UnitZ());
}

}  // namespace
}  // namespace scanloc
