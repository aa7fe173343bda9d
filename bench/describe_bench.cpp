// Description of one full-resolution query, beside PCL's voxel filter with a plain loop.

#include <benchmark/benchmark.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/bench_scans.hpp"

namespace scanloc {
namespace {

/// The polar context as one would write it first, from PCL's filtered cloud.
std::vector<float> PlainPolarContext(const pcl::PointCloud<pcl::PointXYZ>& cloud,
                                     const Params& params) {
  const PolarParams& polar = params.polar;
  std::vector<float> cells(static_cast<std::size_t>(polar.num_rings) * polar.num_sectors);
  for (const pcl::PointXYZ& p : cloud) {
    const float range_m = std::sqrt(p.x * p.x + p.y * p.y);
    if (range_m >= polar.max_range_m) continue;
    float azimuth_rad = std::atan2(p.y, p.x);
    if (azimuth_rad < 0.0F) azimuth_rad += 2.0F * std::numbers::pi_v<float>;
    const int ring = static_cast<int>(range_m / polar.max_range_m * polar.num_rings);
    const int sector =
        std::min(static_cast<int>(azimuth_rad / (2.0 * std::numbers::pi) * polar.num_sectors),
                 polar.num_sectors - 1);
    float& cell = cells[static_cast<std::size_t>(sector) * polar.num_rings + ring];
    cell = std::max(cell, p.z + static_cast<float>(params.sensor_height_m));
  }
  return cells;
}

void PclVoxelGridAndPlainLoop(benchmark::State& state) {
  const Params params;
  const std::vector<PointCloud> scans = bench::FullScans();
  std::vector<pcl::PointCloud<pcl::PointXYZ>::Ptr> clouds;
  for (const PointCloud& scan : scans) {
    auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (const Point& p : scan) cloud->push_back({p.x, p.y, p.z});
    clouds.push_back(cloud);
  }
  std::size_t i = 0;
  const float leaf_m = static_cast<float>(params.voxel_size_m);
  for (auto _ : state) {
    pcl::VoxelGrid<pcl::PointXYZ> filter;
    filter.setLeafSize(leaf_m, leaf_m, leaf_m);
    filter.setInputCloud(clouds[i++ % clouds.size()]);
    pcl::PointCloud<pcl::PointXYZ> filtered;
    filter.filter(filtered);
    benchmark::DoNotOptimize(PlainPolarContext(filtered, params));
  }
}
BENCHMARK(PclVoxelGridAndPlainLoop)->Unit(benchmark::kMicrosecond);

void DescribeQuery(benchmark::State& state) {
  const std::vector<PointCloud> scans = bench::FullScans();
  auto describer = *Describer::Create(Params{});
  std::size_t i = 0;
  for (auto _ : state) {
    const ScanDescriptor descriptor = describer.Describe(scans[i++ % scans.size()]);
    benchmark::DoNotOptimize(MakeKeys(descriptor.polar));
    benchmark::DoNotOptimize(MakeKeys(descriptor.cart));
  }
}
BENCHMARK(DescribeQuery)->Unit(benchmark::kMicrosecond);

void DescribePlaceWithAugmentations(benchmark::State& state) {
  const std::vector<PointCloud> scans = bench::FullScans();
  auto describer = *Describer::Create(Params{});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(describer.DescribePlace(scans[i++ % scans.size()]));
  }
}
BENCHMARK(DescribePlaceWithAugmentations)->Unit(benchmark::kMicrosecond);

void VoxelFilterAlone(benchmark::State& state) {
  const std::vector<PointCloud> scans = bench::FullScans();
  VoxelFilter filter(Params{}.voxel_size_m);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(filter.Apply(scans[i++ % scans.size()]).data());
  }
}
BENCHMARK(VoxelFilterAlone)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();
