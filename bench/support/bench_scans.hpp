#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::bench {

/// Full-resolution scans: the files of $SCANLOC_BENCH_SCANS if set (about 121,000 points for the
/// figures of docs/benchmarks.md), else simulated ones with as many rays as give that size.
inline std::vector<PointCloud> FullScans() {
  std::vector<PointCloud> scans;
  if (const char* folder = std::getenv("SCANLOC_BENCH_SCANS")) {
    std::vector<std::string> paths;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      paths.push_back(file.path().string());
    }
    std::sort(paths.begin(), paths.end());
    for (const std::string& path : paths) {
      if (auto scan = dataset::ReadScan(path); scan.ok()) {
        scans.push_back(std::move(scan->points));
      } else {
        std::fprintf(stderr, "%s\n", scan.status().ToString().c_str());
        std::exit(1);
      }
    }
    return scans;
  }
  sim::SimulateOptions options;
  options.town.length_m = 60.0;
  options.session.spacing_m = 10.0;
  options.lidar.num_azimuths = 2'400;
  const auto drive = *sim::SimulatedDrive::Create(options);
  for (std::size_t i = 0; i < drive.size(); ++i) scans.push_back(drive.Scan(i));
  return scans;
}

}  // namespace scanloc::bench
