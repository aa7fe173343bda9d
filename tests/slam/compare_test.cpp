#include "scanloc/slam/compare.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "slam/simulated_drives.hpp"

namespace scanloc::slam {
namespace {

using test::TownDrive;
using test::TownParams;

std::vector<Observation> Observe(const sim::SimulatedDrive& drive) {
  std::vector<Observation> seen;
  Describer describer = *Describer::Create(TownParams());
  for (std::size_t i = 0; i < drive.size(); ++i) {
    seen.push_back({std::to_string(i), "", drive.T_map_sensor(i),
                    describer.Describe(drive.Scan(i)).structure});
  }
  return seen;
}

/// From the nearest street that was rebuilt [m].
double FromRebuilt_m(const sim::SimulatedDrive& drive, const Eigen::Vector3d& at) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const sim::Path& street : drive.town().rebuilt) {
    for (const Eigen::Vector2d& point : street.points()) {
      nearest_m = std::min(nearest_m, (point - at.head<2>()).norm());
    }
  }
  return nearest_m;
}

TEST(Compare, NamesTheStreetsThatWereRebuiltAndNoOthers) {
  std::size_t num_rebuilt = 0;
  std::size_t num_named = 0;
  std::size_t num_others = 0;
  std::size_t num_wrongly_named = 0;
  for (const std::uint64_t town : {3U, 8U}) {
    const auto before = sim::SimulatedDrive::Create(TownDrive(town, 1));
    sim::SimulateOptions later = TownDrive(town, 2);
    later.town.rebuilt_share = 0.2;
    later.session.lane_shift_m = 1.0;
    const auto after = sim::SimulatedDrive::Create(later);
    ASSERT_TRUE(before.ok() && after.ok());
    const std::vector<Observation> places = Observe(*before);
    const std::vector<Observation> scans = Observe(*after);
    const std::vector<Comparison> compared = *Compare(places, scans, TownParams().automatic, 2);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double from_m = FromRebuilt_m(*after, places[i].T_map_scan.translation());
      const bool is_named = compared[i].change == Change::kChanged;
      if (from_m < 6.0) {
        ++num_rebuilt;
        num_named += is_named ? 1 : 0;
      } else if (from_m > 60.0) {
        ++num_others;
        num_wrongly_named += is_named ? 1 : 0;
      }
    }
  }
  std::printf("named: %zu of %zu rebuilt, %zu of %zu others\n", num_named, num_rebuilt,
              num_wrongly_named, num_others);
  ASSERT_GT(num_rebuilt, 50U);
  ASSERT_GT(num_others, 200U);
  EXPECT_GE(num_named * 100, num_rebuilt * 95);
  EXPECT_LE(num_wrongly_named * 100, num_others);
}

TEST(Compare, SaysNothingWhereTheOtherVisitWasNot) {
  sim::SimulateOptions options = TownDrive(3, 1);
  options.session.to_m = 100.0;
  const std::vector<Observation> some = Observe(*sim::SimulatedDrive::Create(options));
  options.session.from_m = 300.0;
  options.session.to_m = 400.0;
  const std::vector<Observation> others = Observe(*sim::SimulatedDrive::Create(options));
  const std::vector<Comparison> compared = *Compare(some, others, TownParams().automatic, 2);
  for (const Comparison& comparison : compared) {
    EXPECT_EQ(comparison.change, Change::kUnseen);
  }
  EXPECT_TRUE(Compare({}, others, TownParams().automatic, 2)->empty());
}

}  // namespace
}  // namespace scanloc::slam
