// Reading the clouds of a bag, beside describing them.
//   SCANLOC_BENCH_BAG=FILE SCANLOC_BENCH_POSES=/odom bag_bench

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc {
namespace {

// Without a bag or poses in it, the benchmark says so and ends.
std::vector<dataset::ScanFile> Clouds(benchmark::State& state, bool deskew) {
  const char* const bag = std::getenv("SCANLOC_BENCH_BAG");
  const char* const poses = std::getenv("SCANLOC_BENCH_POSES");
  std::vector<std::string> notes;
  const auto clouds = dataset::ListBagScans({.paths = {bag == nullptr ? "" : bag},
                                             .poses_from = poses == nullptr ? "" : poses,
                                             .deskew = deskew},
                                            notes);
  if (clouds.ok()) return *clouds;
  state.SkipWithError(std::string(clouds.status().message()).c_str());
  return {};
}

void Read(benchmark::State& state, bool deskew) {
  const std::vector<dataset::ScanFile> clouds = Clouds(state, deskew);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(dataset::ReadScan(clouds[i++ % clouds.size()]).value().points.data());
  }
}

void ReadClouds(benchmark::State& state) { Read(state, false); }
void ReadCloudsAndTakeMotionOut(benchmark::State& state) { Read(state, true); }

void DescribeClouds(benchmark::State& state) {
  Describer describer = Describer::Create(Params()).value();
  std::vector<PointCloud> scans;
  for (const dataset::ScanFile& cloud : Clouds(state, false)) {
    if (scans.size() == 10) break;
    scans.push_back(dataset::ReadScan(cloud).value().points);
  }
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(describer.Describe(scans[i++ % scans.size()]));
}

BENCHMARK(ReadClouds)->Unit(benchmark::kMicrosecond);
BENCHMARK(ReadCloudsAndTakeMotionOut)->Unit(benchmark::kMicrosecond);
BENCHMARK(DescribeClouds)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();
