#include "scanloc/slam/align_drive.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "scanloc/core/scan/pose_difference.hpp"
#include "slam/simulated_drives.hpp"

namespace scanloc::slam {
namespace {

using test::LoaderOf;
using test::OdometryPlan;
using test::TownDrive;
using test::TownParams;

std::shared_ptr<const Map> MapOf(const sim::SimulatedDrive& drive) {
  auto map = std::make_shared<Map>(MakeEmptyMap(TownParams()));
  map->sessions = {"mapped"};
  Describer describer = *Describer::Create(map->params);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    map->AppendDescriptor(static_cast<std::int32_t>(i), describer.DescribePlace(drive.Scan(i)));
    map->places.push_back({drive.T_map_sensor(i), 0, 0});
  }
  return map;
}

/// Of the town's first 600 m.
std::shared_ptr<const Map> MapOfTown() {
  sim::SimulateOptions options = TownDrive(3, 1);
  options.session.to_m = 600.0;
  return MapOf(*sim::SimulatedDrive::Create(options));
}

double WorstError_m(const ClosedDrive& aligned, const sim::SimulatedDrive& drive) {
  double worst_m = 0.0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const Eigen::Vector3d error =
        aligned.T_map_scan[i].translation() - drive.T_map_sensor(i).translation();
    worst_m = std::max(worst_m, error.norm());
  }
  return worst_m;
}

TEST(AlignDrive, BringsADriveOfAnotherKindIntoTheFrameOfTheMap) {
  const std::shared_ptr<const Map> map = MapOfTown();
  sim::SimulateOptions options = TownDrive(3, 2);
  options.session.reverse = true;
  options.session.lane_shift_m = 3.5;
  options.session.tilt_deg = 2.0;
  options.session.from_m = 100.0;
  options.session.to_m = 700.0;  // begins where nothing was mapped
  const auto drive = sim::SimulatedDrive::Create(options);
  ASSERT_TRUE(drive.ok());
  const auto aligned =
      AlignDrive(map, OdometryPlan(*drive, 1.0), LoaderOf(*drive), {.spacing_m = 4.0});
  ASSERT_TRUE(aligned.ok()) << aligned.status();
  EXPECT_LT(WorstError_m(*aligned, *drive), 1.0);
}

TEST(AlignDrive, RefusesADriveThatSharesNothingWithTheMap) {
  const std::shared_ptr<const Map> map = MapOfTown();
  sim::SimulateOptions options = TownDrive(44, 1);
  options.session.to_m = 300.0;
  const auto drive = sim::SimulatedDrive::Create(options);
  ASSERT_TRUE(drive.ok());
  const auto refused =
      AlignDrive(map, OdometryPlan(*drive, 1.0), LoaderOf(*drive), {.spacing_m = 4.0});
  ASSERT_TRUE(absl::IsFailedPrecondition(refused.status())) << refused.status();
  EXPECT_NE(refused.status().message().find("looked up among 300 places"), std::string::npos)
      << refused.status();
}

}  // namespace
}  // namespace scanloc::slam
