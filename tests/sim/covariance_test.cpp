// Whether the covariances that are told are those of the errors, on simulated drives.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::sim {
namespace {

/// A world that is mapped by one drive and asked by another.
struct Case {
  std::string name;
  SimulateOptions mapped;
  SimulateOptions asked;
  double scale = 1.0;
};

Case MakeCase(const std::string& world, std::uint64_t seed, double lane_shift_m, double tilt_deg) {
  Case made{.name = world + " " + std::to_string(seed)};
  SimulateOptions& options = made.mapped;
  options.world.kind = *ParseWorldKind(world);
  options.town.town_seed = seed;
  options.town.length_m = 500.0;
  options.lidar.num_rays = 32;
  options.lidar.num_azimuths = 720;
  options.session.spacing_m = 2.0;
  made.asked = options;
  made.asked.session.session_seed = 2;
  made.asked.session.lane_shift_m = lane_shift_m;
  made.asked.session.tilt_deg = tilt_deg;
  made.asked.session.spacing_m = 7.0;
  return made;
}

Case OnHills(std::uint64_t seed) {
  Case made = MakeCase("forest", seed, 1.0, 2.0);
  made.mapped.session.spacing_m = 5.0;
  return made;
}

/// A low robot, with half of the furniture moved in between.
Case AtHome(std::uint64_t seed) {
  Case made = MakeCase("home", seed, 0.0, 0.0);
  made.scale = 0.35;
  for (SimulateOptions* options : {&made.mapped, &made.asked}) {
    options->lidar.num_rays = 16;
    options->session.sensor_height_m = 0.3;
  }
  made.mapped.session.spacing_m = 0.5;
  made.asked.session.spacing_m = 0.7;
  return made;
}

std::shared_ptr<const Localizer> MapOf(const SimulatedDrive& drive, const Params& params,
                                       Describer& describer) {
  auto map = std::make_shared<Map>(MakeEmptyMap(params));
  map->sessions = {"only"};
  for (std::size_t i = 0; i < drive.size(); ++i) {
    map->AppendDescriptor(static_cast<std::int32_t>(i), describer.DescribePlace(drive.Scan(i)));
    map->places.push_back({drive.T_map_sensor(i), 0, 0});
  }
  return *Localizer::Create(map);
}

/// Normalised estimation errors squared of all answers that are right: of six degrees of freedom.
std::vector<double> NeesOf(const Case& asked) {
  const SimulatedDrive mapped = *SimulatedDrive::Create(asked.mapped);
  Params params;
  params.sensor_height_m = asked.mapped.session.sensor_height_m;
  params.automatic = AutoParamsAtScale(asked.scale);
  Describer describer = *Describer::Create(params);
  const auto localizer = MapOf(mapped, params, describer);
  const SimulatedDrive drive = *SimulatedDrive::Create(asked.asked);
  std::vector<double> nees;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const Answer answer = *localizer->Localize(describer.Describe(drive.Scan(i)));
    if (answer.outcome != Outcome::kLocalized) continue;
    const Candidate& best = answer.candidates.front();
    EXPECT_TRUE(best.covariance && CheckCovariance(*best.covariance).ok());
    if (MissOf(DifferenceOf(best.T_map_query, drive.T_map_sensor(i))).any()) continue;
    const Eigen::Matrix<double, 6, 1> error = ErrorOf(best.T_map_query, drive.T_map_sensor(i));
    nees.push_back(error.dot(best.covariance->ldlt().solve(error)));
  }
  return nees;
}

TEST(Covariance, IsThatOfTheErrors) {
  // Of six degrees of freedom, 95 of 100 are less than this.
  constexpr double kChiSquared95 = 12.59;
  double sum_of_all = 0.0;
  std::size_t num_within = 0, num_all = 0;
  for (const Case& asked : {MakeCase("town", 21, 0.0, 0.0), MakeCase("town", 22, 3.5, 3.0),
                            MakeCase("campus", 23, 1.0, 0.0), MakeCase("forest", 24, 1.0, 2.0),
                            OnHills(324), AtHome(106)}) {
    const std::vector<double> nees = NeesOf(asked);
    ASSERT_GT(nees.size(), 40U) << asked.name;
    double sum = 0.0;
    std::size_t within = 0;
    for (const double value : nees) {
      sum += value;
      within += value < kChiSquared95 ? 1 : 0;
    }
    const double mean = sum / static_cast<double>(nees.size());
    std::printf("%-12s %3zu answers, mean NEES %.2f of 6, %.3f within 95 %%\n", asked.name.c_str(),
                nees.size(), mean, static_cast<double>(within) / static_cast<double>(nees.size()));
    // On level ground as over hills, and indoors.
    EXPECT_GT(mean, 2.4) << asked.name;
    EXPECT_LT(mean, 8.5) << asked.name;
    num_within += within;
    sum_of_all += sum;
    num_all += nees.size();
  }
  const double mean = sum_of_all / static_cast<double>(num_all);
  const double share = static_cast<double>(num_within) / static_cast<double>(num_all);
  EXPECT_GT(mean, 4.5);
  EXPECT_LT(mean, 7.0);
  EXPECT_GT(share, 0.85);
  EXPECT_LT(share, 0.97);
}

}  // namespace
}  // namespace scanloc::sim
