#include "support/bench_map.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::bench {
namespace {

constexpr double kSpacing_m = 1.5;
constexpr std::size_t kNumQueries = 200;

sim::SimulatedDrive Drive(std::uint64_t session_seed, double lane_shift_m) {
  sim::SimulateOptions options;
  options.town.town_seed = 42;
  options.town.length_m = kSpacing_m * static_cast<double>(NumPlaces() + 2);
  options.session.session_seed = session_seed;
  options.session.lane_shift_m = lane_shift_m;
  options.session.spacing_m = kSpacing_m;
  options.lidar.num_rays = 32;
  options.lidar.num_azimuths = 360;
  return sim::SimulatedDrive::Create(options).value();
}

BenchMap MakeLargeMap() {
  BenchMap map;
  map.path = (std::filesystem::temp_directory_path() /
              ("scanloc_bench_" + std::to_string(getpid()) + ".scanloc"))
                 .string();
  std::fprintf(stderr, "simulating and building a map of %zu places ...\n", NumPlaces());
  {
    const sim::SimulatedDrive drive = Drive(1, 0.0);
    mapdb::SessionPlan plan{.name = "drive"};
    for (std::size_t i = 0; i < std::min(drive.size(), NumPlaces()); ++i) {
      plan.scans.push_back({std::to_string(i), drive.stamp_ns(i), drive.T_map_sensor(i)});
    }
    mapdb::BuildOptions options;
    options.path = map.path;
    options.params = map.params;
    options.commit_interval = 1000;
    mapdb::BuildMap(options, plan, [&](std::size_t i) -> absl::StatusOr<PointCloud> {
      return drive.Scan(i);
    }).value();
  }
  const sim::SimulatedDrive drive = Drive(2, 1.0);
  Describer describer = Describer::Create(map.params).value();
  for (std::size_t q = 0; q < kNumQueries; ++q) {
    map.queries.push_back(describer.Describe(drive.Scan(q * drive.size() / kNumQueries)));
  }
  std::atexit([] {
    std::error_code ignored;  // a leftover in the temporary folder harms nobody
    std::filesystem::remove(LargeMap().path, ignored);
  });
  return map;
}

}  // namespace

std::size_t NumPlaces() {
  const char* places = std::getenv("SCANLOC_BENCH_PLACES");
  return places == nullptr ? 20'000 : std::strtoul(places, nullptr, 10);
}

const BenchMap& LargeMap() {
  static const BenchMap* const map = new BenchMap(MakeLargeMap());
  return *map;
}

}  // namespace scanloc::bench
